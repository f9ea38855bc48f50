// Loads the client library.

#pragma once

#include "CoreMinimal.h"
#include "Modules/ModuleInterface.h"

DECLARE_LOG_CATEGORY_EXTERN(LogWade, Log, All);

class FWadeModule : public IModuleInterface
{
public:
	virtual void StartupModule() override;
	virtual void ShutdownModule() override;

	/** Whether the client library is loaded; nothing of it may be called otherwise. */
	static bool IsLibraryLoaded();

private:
	void* Library = nullptr;
};
