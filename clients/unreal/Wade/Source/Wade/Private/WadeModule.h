// Loads the client library.

#pragma once

#include "CoreMinimal.h"
#include "Modules/ModuleInterface.h"

DECLARE_LOG_CATEGORY_EXTERN(LogWade, Log, All);

class FWadeModule : public IModuleInterface
{
public:
	virtual void StartupModule() override;

	/** Whether the client library is loaded; nothing of it may be called otherwise. */
	static bool IsLibraryLoaded();

private:
	/** Stays loaded until the process ends: a client that is closed may still be at it in the background. */
	void* Library = nullptr;
};
