#include "WadeSimCallback.h"

#include "HAL/PlatformTime.h"
#include "WadeAxes.h"

namespace
{
	using namespace WadeAxes;

	std::uint64_t NowNs()
	{
		return std::uint64_t(FPlatformTime::Seconds() * 1.0e9);
	}

	/** Mass and place of its center, in the hull's frame. */
	wade::Body BodyOf(const Chaos::FRigidBodyHandle_Internal& Handle, const FTransform& HullInBody)
	{
		wade::Body Body;
		Body.mass = Handle.M();
		const FQuat HullFromBody = HullInBody.GetRotation().Inverse();
		Body.center_of_mass = FromUnreal(HullFromBody.RotateVector(FVector(Handle.CenterOfMass()) - HullInBody.GetLocation()));
		const FQuat HullFromPrincipal = HullFromBody * FQuat(Handle.RotationOfMass());
		const wade::Vec3 Principal{double(Handle.I().X), double(Handle.I().Y), double(Handle.I().Z)};
		Body.inertia = wade::rotated_diagonal(WadeAxes::Rotation(HullFromPrincipal), wade::axes::inertia_from_unreal(Principal));
		return Body;
	}

	/** Chaos has positions of the body's origin and velocities of its center of mass. */
	wade::Motion MotionOf(const Chaos::FRigidBodyHandle_Internal& Handle, const FTransform& HullInBody)
	{
		const FQuat WorldFromBody(Handle.R());
		wade::Motion Motion;
		Motion.position = FromUnreal(FVector(Handle.X()) + WorldFromBody.RotateVector(FVector(Handle.CenterOfMass())));
		Motion.attitude = WadeAxes::Rotation(WorldFromBody * HullInBody.GetRotation());
		Motion.velocity = FromUnreal(FVector(Handle.V()));
		Motion.angular_velocity = wade::axes::angular_from_unreal(Plain(FVector(Handle.W())));
		return Motion;
	}

	bool Moves(const Chaos::FRigidBodyHandle_Internal* Handle)
	{
		// a sleeping body is asked about too: a load wakes it up, and a body in moving water must not sleep
		return Handle != nullptr
			&& (Handle->ObjectState() == Chaos::EObjectStateType::Dynamic || Handle->ObjectState() == Chaos::EObjectStateType::Sleeping);
	}

	FWadeReport ReportOf(const FWadeScene& Scene, const wade::Member& Member)
	{
		const wade::Hydrodynamics& Hydrodynamics = *Member.hydrodynamics;
		const wade::StepLoad& Load = Member.load;
		const wade::Motion& Motion = Member.motion;
		const wade_forces& Forces = Hydrodynamics.forces();
		FWadeReport Report;
		Report.Vehicle = Scene.Vehicle;
		Report.Link = Hydrodynamics.link();
		Report.BundleVersion = Forces.bundle_version;
		Report.CenterOfMass = Member.body.center_of_mass;
		Report.Place = ToUnreal(Motion.position);
		Report.Force = Unreal(wade::axes::mirrored(Load.force));
		Report.DepthCm = Load.immersion.depth / wade::axes::meters_per_unit;
		Report.LevelCm = -Load.immersion.height / wade::axes::meters_per_unit;
		Report.BedClearanceCm = Forces.bed_clearance_m / wade::axes::meters_per_unit;
		Report.DepthOutsideCm = Load.asked > 0 ? Forces.outside[WADE_QUANTITY_DEPTH] / wade::axes::meters_per_unit : 0.0;
		Report.bWater = Scene.bWater;
		Report.WaterPoint = ToUnreal(Scene.Water.point);
		Report.WaterNormal = Unreal(wade::axes::mirrored(Scene.Water.normal));
		const wade::Vec3 Origin = wade::hull_origin(Member.body, Motion);
		for (uint32 Surface = 0; Load.asked > 0 && Surface < Forces.surface_count; ++Surface)
		{
			const float* Point = Forces.surface_point_m[Surface];
			const float* Force = Forces.surface_force_n[Surface];
			Report.SurfacePoints.Add(ToUnreal(Origin + wade::rotate(Motion.attitude, wade::Vec3{Point[0], Point[1], Point[2]})));
			Report.SurfaceForces.Add(Unreal(wade::axes::mirrored(wade::rotate(Motion.attitude, wade::Vec3{Force[0], Force[1], Force[2]}))));
		}
		return Report;
	}
}

FWadeVehicle::FWadeVehicle(const TSharedRef<FWadeLink, ESPMode::ThreadSafe>& InLink, const wade::Pacing& Pacing)
	: Link(InLink)
	, Hydrodynamics([Asked = InLink](const wade_state& State, std::uint64_t Budget, wade_forces& Forces) { return Asked->Evaluate(State, Budget, Forces); },
		NowNs, Pacing)
{
}

FWadeSimCallback::FWadeSimCallback()
	: Fleet(NowNs)
{
}

FName FWadeSimCallback::GetFNameForStatId() const
{
	return FName(TEXT("FWadeSimCallback"));
}

void FWadeSimCallback::OnPreSimulate_Internal()
{
	// holds for the steps until the next one
	if (const FWadeSimInput* Input = GetConsumerInput_Internal())
	{
		Scenes = Input->Scenes;
	}
	const double Time = GetDeltaTime_Internal();
	Members.clear();
	MemberScenes.clear();
	for (const FWadeScene& Scene : Scenes)
	{
		if (Scene.Proxy == nullptr)
		{
			continue;
		}
		FWadeVehicle& Vehicle = *Scene.Vehicle;
		const Chaos::FRigidBodyHandle_Internal* Handle = Scene.Proxy->GetPhysicsThreadAPI();
		const bool bMoves = Moves(Handle) && Time > 0.0;
		if (!bMoves || !Scene.bWater || Vehicle.Beginnings != Scene.Beginnings)
		{
			Vehicle.Beginnings = Scene.Beginnings;
			Vehicle.Hydrodynamics.begin_anew();
		}
		if (!bMoves)
		{
			continue;
		}
		wade::Member Member;
		Member.hydrodynamics = &Vehicle.Hydrodynamics;
		Member.body = BodyOf(*Handle, Scene.HullInBody);
		Member.motion = MotionOf(*Handle, Scene.HullInBody);
		if (!Scene.bWater)
		{
			GetProducerOutputData_Internal().Reports.Add(ReportOf(Scene, Member));
			continue;
		}
		Vehicle.Hydrodynamics.set_rest_table(Scene.Table);
		Member.group = Vehicle.Link->Group();
		if (Vehicle.Link->HasBatches())
		{
			Member.ask_batch = [Link = &*Vehicle.Link](const wade_state* States, size_t Count, std::uint64_t Budget, wade_forces* Forces)
			{
				return Link->EvaluateBatch(States, Count, Budget, Forces);
			};
		}
		Member.water = Scene.Water;
		Member.surroundings = Scene.Surroundings;
		Members.push_back(std::move(Member));
		MemberScenes.push_back(&Scene);
	}
	if (Members.empty())
	{
		return;
	}
	Fleet.step(Members, Time);
	for (size_t Index = 0; Index < Members.size(); ++Index)
	{
		const wade::StepLoad& Load = Members[Index].load;
		// no load on a body that the water does not touch, so that it may go to sleep
		if (wade::norm(Load.force) + wade::norm(Load.moment) > 0.0)
		{
			Chaos::FRigidBodyHandle_Internal* Handle = MemberScenes[Index]->Proxy->GetPhysicsThreadAPI();
			Handle->AddForce(Unreal(wade::axes::force_to_unreal(Load.force)), true);
			Handle->AddTorque(Unreal(wade::axes::moment_to_unreal(Load.moment)), true);
		}
		GetProducerOutputData_Internal().Reports.Add(ReportOf(*MemberScenes[Index], Members[Index]));
	}
}
