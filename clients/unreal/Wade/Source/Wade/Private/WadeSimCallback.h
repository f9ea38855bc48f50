// What runs in the physics thread, before each step of the solver.

#pragma once

#include "Chaos/SimCallbackObject.h"
#include "CoreMinimal.h"
#include "PhysicsProxy/SingleParticlePhysicsProxy.h"
#include "Templates/SharedPointer.h"
#include "WadeLink.h"
#include "core/hydrodynamics.h"

/** What the game thread knows. */
struct FWadeScene
{
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

/** From the game thread, once a frame. */
struct FWadeSimInput : public Chaos::FSimCallbackInput
{
	FWadeScene Scene;

	void Reset() { Scene = FWadeScene(); }
};

/** To the game thread, once a step. */
struct FWadeSimOutput : public Chaos::FSimCallbackOutput
{
	FWadeReport Report;

	void Reset() { Report = FWadeReport(); }
};

class FWadeSimCallback : public Chaos::TSimCallbackObject<FWadeSimInput, FWadeSimOutput, Chaos::ESimCallbackOptions::Presimulate>
{
public:
	/** Before the first step. */
	void Begin(const TSharedPtr<FWadeLink, ESPMode::ThreadSafe>& InLink, const wade::Pacing& Pacing);

private:
	virtual void OnPreSimulate_Internal() override;
	void ReportStep(const wade::Body& Body, const wade::Motion& Motion, const wade::StepLoad& Load);

	TSharedPtr<FWadeLink, ESPMode::ThreadSafe> Link;
	TUniquePtr<wade::Hydrodynamics> Hydrodynamics;
	/** The last input. Its body lives: the component takes it back when the body's physics state ends. */
	FWadeScene Scene;
	uint32 Beginnings = 0;
};
