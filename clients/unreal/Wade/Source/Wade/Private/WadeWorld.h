// The vehicles of a world that the water acts on, and the one callback in its physics thread that asks for all of them. Game thread.

#pragma once

#include "CoreMinimal.h"
#include "Subsystems/WorldSubsystem.h"
#include "Templates/SharedPointer.h"
#include "WadeSimCallback.h"
#include "WadeWorld.generated.h"

UCLASS()
class UWadeWorld : public UWorldSubsystem
{
	GENERATED_BODY()

public:
	/** Registers the callback with the first vehicle. False where the world has no physics. */
	bool AddVehicle(const TSharedRef<FWadeVehicle, ESPMode::ThreadSafe>& Vehicle);
	/** And takes it back with the last. */
	void RemoveVehicle(const TSharedPtr<FWadeVehicle, ESPMode::ThreadSafe>& Vehicle);

	/** For the physics steps from now on. `Scene.Vehicle` was added. */
	void SetScene(const FWadeScene& Scene);

	/** Of the last step that is known here; null before it. */
	TSharedPtr<FWadeReport> LatestReport(const TSharedPtr<FWadeVehicle, ESPMode::ThreadSafe>& Vehicle);

	virtual void Deinitialize() override;

private:
	struct FEntry
	{
		FWadeScene Scene;
		TSharedPtr<FWadeReport> Latest;
	};

	FEntry* Find(const FWadeVehicle* Vehicle);
	void TakeOutput();
	void GiveInput();
	void Unregister();

	TArray<FEntry> Entries;
	/** Owned by the physics solver once it is registered. */
	FWadeSimCallback* Callback = nullptr;
};
