#include "WadeSimCallback.h"

#include "HAL/PlatformTime.h"
#include "WadeAxes.h"

using namespace WadeAxes;

namespace
{
	/** Mass and place of its center, in the hull's frame. */
	wade::Body BodyOf(const Chaos::FRigidBodyHandle_Internal& Handle, const FTransform& HullInBody)
	{
		wade::Body Body;
		Body.mass = Handle.M();
		const FQuat HullFromBody = HullInBody.GetRotation().Inverse();
		Body.center_of_mass = FromUnreal(HullFromBody.RotateVector(FVector(Handle.CenterOfMass()) - HullInBody.GetLocation()));
		const FQuat HullFromPrincipal = HullFromBody * FQuat(Handle.RotationOfMass());
		const wade::Vec3 Principal{double(Handle.I().X), double(Handle.I().Y), double(Handle.I().Z)};
		Body.inertia = wade::rotated_diagonal(Rotation(HullFromPrincipal), wade::axes::inertia_from_unreal(Principal));
		return Body;
	}

	/** Chaos has positions of the body's origin and velocities of its center of mass. */
	wade::Motion MotionOf(const Chaos::FRigidBodyHandle_Internal& Handle, const FTransform& HullInBody)
	{
		const FQuat WorldFromBody(Handle.R());
		wade::Motion Motion;
		Motion.position = FromUnreal(FVector(Handle.X()) + WorldFromBody.RotateVector(FVector(Handle.CenterOfMass())));
		Motion.attitude = Rotation(WorldFromBody * HullInBody.GetRotation());
		Motion.velocity = FromUnreal(FVector(Handle.V()));
		Motion.angular_velocity = wade::axes::angular_from_unreal(Plain(FVector(Handle.W())));
		return Motion;
	}
}

void FWadeSimCallback::Begin(const TSharedPtr<FWadeLink, ESPMode::ThreadSafe>& InLink, const wade::Pacing& Pacing)
{
	Link = InLink;
	const auto Ask = [Client = InLink.Get()](const wade_state& State, std::uint64_t Budget, wade_forces& Forces)
	{
		return Client->Evaluate(State, Budget, Forces);
	};
	const auto Clock = [] { return std::uint64_t(FPlatformTime::Seconds() * 1.0e9); };
	Hydrodynamics = MakeUnique<wade::Hydrodynamics>(Ask, Clock, Pacing);
}

void FWadeSimCallback::OnPreSimulate_Internal()
{
	// holds for the steps until the next one
	if (const FWadeSimInput* Input = GetConsumerInput_Internal())
	{
		Scene = Input->Scene;
	}
	if (Scene.Proxy == nullptr || !Hydrodynamics)
	{
		return;
	}
	Chaos::FRigidBodyHandle_Internal* Handle = Scene.Proxy->GetPhysicsThreadAPI();
	const double Time = GetDeltaTime_Internal();
	// a sleeping body is asked about too: a load wakes it up, and a body in moving water must not sleep
	const bool bMoves = Handle != nullptr
		&& (Handle->ObjectState() == Chaos::EObjectStateType::Dynamic || Handle->ObjectState() == Chaos::EObjectStateType::Sleeping);
	if (!bMoves || Time <= 0.0)
	{
		Hydrodynamics->begin_anew();
		return;
	}
	if (Beginnings != Scene.Beginnings || !Scene.bWater)
	{
		Beginnings = Scene.Beginnings;
		Hydrodynamics->begin_anew();
	}
	const wade::Body Body = BodyOf(*Handle, Scene.HullInBody);
	const wade::Motion Motion = MotionOf(*Handle, Scene.HullInBody);
	wade::StepLoad Load;
	if (Scene.bWater)
	{
		Hydrodynamics->set_rest_table(Scene.Table);
		Load = Hydrodynamics->step(Body, Motion, Scene.Water, Scene.Surroundings, Time);
		// no load on a body that the water does not touch, so that it may go to sleep
		if (wade::norm(Load.force) + wade::norm(Load.moment) > 0.0)
		{
			Handle->AddForce(Unreal(wade::axes::force_to_unreal(Load.force)), true);
			Handle->AddTorque(Unreal(wade::axes::moment_to_unreal(Load.moment)), true);
		}
	}
	ReportStep(Body, Motion, Load);
}

void FWadeSimCallback::ReportStep(const wade::Body& Body, const wade::Motion& Motion, const wade::StepLoad& Load)
{
	FWadeReport& Report = GetProducerOutputData_Internal().Report;
	const wade_forces& Forces = Hydrodynamics->forces();
	Report = FWadeReport();
	Report.Link = Hydrodynamics->link();
	Report.BundleVersion = Forces.bundle_version;
	Report.CenterOfMass = Body.center_of_mass;
	Report.Place = ToUnreal(Motion.position);
	Report.Force = Unreal(wade::axes::mirrored(Load.force));
	Report.DepthCm = Load.immersion.depth / wade::axes::meters_per_unit;
	Report.LevelCm = -Load.immersion.height / wade::axes::meters_per_unit;
	Report.BedClearanceCm = Forces.bed_clearance_m / wade::axes::meters_per_unit;
	Report.DepthOutsideCm = Load.asked > 0 ? Forces.outside[WADE_QUANTITY_DEPTH] / wade::axes::meters_per_unit : 0.0;
	Report.bWater = Scene.bWater;
	Report.WaterPoint = ToUnreal(Scene.Water.point);
	Report.WaterNormal = Unreal(wade::axes::mirrored(Scene.Water.normal));
	const wade::Vec3 Origin = wade::hull_origin(Body, Motion);
	for (uint32 Surface = 0; Load.asked > 0 && Surface < Forces.surface_count; ++Surface)
	{
		const float* Point = Forces.surface_point_m[Surface];
		const float* Force = Forces.surface_force_n[Surface];
		Report.SurfacePoints.Add(ToUnreal(Origin + wade::rotate(Motion.attitude, wade::Vec3{Point[0], Point[1], Point[2]})));
		Report.SurfaceForces.Add(Unreal(wade::axes::mirrored(wade::rotate(Motion.attitude, wade::Vec3{Force[0], Force[1], Force[2]}))));
	}
}
