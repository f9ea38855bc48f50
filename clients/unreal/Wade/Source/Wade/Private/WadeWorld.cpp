#include "WadeWorld.h"

#include "Engine/World.h"
#include "PBDRigidsSolver.h"
#include "Physics/Experimental/PhysScene_Chaos.h"

bool UWadeWorld::AddVehicle(const TSharedRef<FWadeVehicle, ESPMode::ThreadSafe>& Vehicle)
{
	if (Callback == nullptr)
	{
		FPhysScene* PhysicsScene = GetWorld()->GetPhysicsScene();
		if (PhysicsScene == nullptr)
		{
			return false;
		}
		Callback = PhysicsScene->GetSolver()->CreateAndRegisterSimCallbackObject_External<FWadeSimCallback>();
	}
	FEntry Entry;
	Entry.Scene.Vehicle = Vehicle;
	Entries.Add(Entry);
	return true;
}

void UWadeWorld::RemoveVehicle(const TSharedPtr<FWadeVehicle, ESPMode::ThreadSafe>& Vehicle)
{
	Entries.RemoveAll([&Vehicle](const FEntry& Entry) { return Entry.Scene.Vehicle == Vehicle; });
	if (Entries.Num() == 0)
	{
		Unregister();
	}
	else
	{
		GiveInput();
	}
}

void UWadeWorld::SetScene(const FWadeScene& Scene)
{
	if (FEntry* Entry = Find(Scene.Vehicle.Get()))
	{
		Entry->Scene = Scene;
		GiveInput();
	}
}

TSharedPtr<FWadeReport> UWadeWorld::LatestReport(const TSharedPtr<FWadeVehicle, ESPMode::ThreadSafe>& Vehicle)
{
	TakeOutput();
	const FEntry* Entry = Find(Vehicle.Get());
	return Entry != nullptr ? Entry->Latest : nullptr;
}

void UWadeWorld::Deinitialize()
{
	Entries.Reset();
	Unregister();
	Super::Deinitialize();
}

UWadeWorld::FEntry* UWadeWorld::Find(const FWadeVehicle* Vehicle)
{
	return Entries.FindByPredicate([Vehicle](const FEntry& Entry) { return Entry.Scene.Vehicle.Get() == Vehicle; });
}

void UWadeWorld::TakeOutput()
{
	while (Callback != nullptr)
	{
		Chaos::TSimCallbackOutputHandle<FWadeSimOutput> Output = Callback->PopOutputData_External();
		if (!Output)
		{
			return;
		}
		for (FWadeReport& Report : Output->Reports)
		{
			if (FEntry* Entry = Find(Report.Vehicle.Get()))
			{
				Entry->Latest = MakeShared<FWadeReport>(MoveTemp(Report));
			}
		}
	}
}

void UWadeWorld::GiveInput()
{
	if (Callback == nullptr)
	{
		return;
	}
	TArray<FWadeScene>& Scenes = Callback->GetProducerInputData_External()->Scenes;
	Scenes.Reset();
	for (const FEntry& Entry : Entries)
	{
		Scenes.Add(Entry.Scene);
	}
}

void UWadeWorld::Unregister()
{
	const UWorld* World = GetWorld();
	FPhysScene* PhysicsScene = World != nullptr ? World->GetPhysicsScene() : nullptr;
	if (Callback != nullptr && PhysicsScene != nullptr)
	{
		// the solver frees it when its thread is done with it, and with it the last hold on the vehicles' links
		PhysicsScene->GetSolver()->UnregisterAndFreeSimCallbackObject_External(Callback);
	}
	Callback = nullptr;
}
