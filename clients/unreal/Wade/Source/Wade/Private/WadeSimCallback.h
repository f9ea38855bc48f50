// What runs in the physics thread, before each step of the solver: all vehicles of a world together.

#pragma once

#include "Chaos/SimCallbackObject.h"
#include "CoreMinimal.h"
#include "PhysicsProxy/SingleParticlePhysicsProxy.h"
#include "Templates/SharedPointer.h"
#include "WadeLink.h"
#include "core/fleet.h"

#include <vector>

/** A vehicle as the physics thread has it. Made in the game thread, which touches nothing of it but the link. */
class FWadeVehicle
{
public:
	FWadeVehicle(const TSharedRef<FWadeLink, ESPMode::ThreadSafe>& InLink, const wade::Pacing& Pacing);

	const TSharedRef<FWadeLink, ESPMode::ThreadSafe> Link;
	wade::Hydrodynamics Hydrodynamics;
	/** Those of the last scene. */
	uint32 Beginnings = 0;
};

/** What the game thread knows of a vehicle. */
struct FWadeScene
{
	TSharedPtr<FWadeVehicle, ESPMode::ThreadSafe> Vehicle;
	/** The component takes it back when the body's physics state ends. */
	Chaos::FSingleParticlePhysicsProxy* Proxy = nullptr;
	FTransform HullInBody = FTransform::Identity;
	wade::Water Water;
	bool bWater = false;
	wade::Surroundings Surroundings;
	std::shared_ptr<const wade::RestTable> Table;
	/** Another number than before: the motion before does not count. */
	uint32 Beginnings = 0;
};

/** What came of a step: world, Unreal's units but forces, which are in N. */
struct FWadeReport
{
	TSharedPtr<FWadeVehicle, ESPMode::ThreadSafe> Vehicle;
	wade::LinkState Link = wade::LinkState::Connecting;
	uint32 BundleVersion = 0;
	/** Hull frame [m]. */
	wade::Vec3 CenterOfMass;
	FVector Place = FVector::ZeroVector;
	FVector Force = FVector::ZeroVector;
	double DepthCm = 0.0;
	double LevelCm = 0.0;
	/** As the server used it; 0 where it has not answered. */
	double BedClearanceCm = 0.0;
	/** How far the depth lies outside the server's training domain: negative below, positive above. */
	double DepthOutsideCm = 0.0;
	bool bWater = false;
	FVector WaterPoint = FVector::ZeroVector;
	FVector WaterNormal = FVector(0.0, 0.0, 1.0);
	TArray<FVector> SurfacePoints;
	TArray<FVector> SurfaceForces;
};

/** From the game thread, once a frame: all vehicles of the world, since an input may be skipped. */
struct FWadeSimInput : public Chaos::FSimCallbackInput
{
	TArray<FWadeScene> Scenes;

	void Reset() { Scenes.Reset(); }
};

/** To the game thread, once a step. */
struct FWadeSimOutput : public Chaos::FSimCallbackOutput
{
	TArray<FWadeReport> Reports;

	void Reset() { Reports.Reset(); }
};

class FWadeSimCallback : public Chaos::TSimCallbackObject<FWadeSimInput, FWadeSimOutput, Chaos::ESimCallbackOptions::Presimulate>
{
public:
	FWadeSimCallback();

	virtual FName GetFNameForStatId() const override;

private:
	virtual void OnPreSimulate_Internal() override;

	/** Those of the last input. */
	TArray<FWadeScene> Scenes;
	wade::Fleet Fleet;
	/** Of this step; kept for their room. */
	std::vector<wade::Member> Members;
	std::vector<const FWadeScene*> MemberScenes;
};
