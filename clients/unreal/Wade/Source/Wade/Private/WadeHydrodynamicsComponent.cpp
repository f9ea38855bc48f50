#include "WadeHydrodynamicsComponent.h"

#include "CollisionQueryParams.h"
#include "Components/PrimitiveComponent.h"
#include "Engine/HitResult.h"
#include "Engine/World.h"
#include "GameFramework/Actor.h"
#include "PhysicsEngine/BodyInstance.h"
#include "WadeAxes.h"
#include "WadeDebugDraw.h"
#include "WadeLink.h"
#include "WadeModule.h"
#include "WadeSettings.h"
#include "WadeSimCallback.h"
#include "WadeWorld.h"

#include <limits>
#include <optional>
#include <string>

namespace
{
	constexpr uint64 VehicleTimeoutNs = 2000000000;

	/** The property's to the core's: 0 is not known. */
	double RadiusOf(double HullRadiusCm)
	{
		return HullRadiusCm > 0.0 ? wade::axes::meters_per_unit * HullRadiusCm : std::numeric_limits<double>::infinity();
	}

	EWadeLinkState Shown(wade::LinkState State)
	{
		switch (State)
		{
		case wade::LinkState::Connecting:
			return EWadeLinkState::Connecting;
		case wade::LinkState::Serving:
			return EWadeLinkState::Serving;
		case wade::LinkState::Stale:
			return EWadeLinkState::Stale;
		case wade::LinkState::Lost:
			return EWadeLinkState::Lost;
		case wade::LinkState::UnknownVehicle:
			return EWadeLinkState::UnknownVehicle;
		case wade::LinkState::Incompatible:
			return EWadeLinkState::Incompatible;
		case wade::LinkState::Refused:
			return EWadeLinkState::Refused;
		}
		return EWadeLinkState::Disconnected;
	}
}

UWadeHydrodynamicsComponent::UWadeHydrodynamicsComponent()
{
	PrimaryComponentTick.bCanEverTick = true;
	PrimaryComponentTick.TickGroup = TG_PrePhysics;
}

void UWadeHydrodynamicsComponent::BeginPlay()
{
	Super::BeginPlay();
	if (!FWadeModule::IsLibraryLoaded())
	{
		return;
	}
	UPrimitiveComponent* Body = FindBody();
	if (Body == nullptr)
	{
		UE_LOG(LogWade, Error, TEXT("%s: the root component is not a primitive, so that the water has no body to act on."), *GetOwner()->GetName());
		return;
	}
	const UWadeSettings* Settings = GetDefault<UWadeSettings>();
	const TSharedRef<FWadeLink, ESPMode::ThreadSafe> Link =
		MakeShared<FWadeLink, ESPMode::ThreadSafe>(WadeConnection(Settings->Address(), Vehicle), Settings->bPollForAnswers);
	UWadeWorld* WadeWorld = FindWadeWorld();
	if (!Link->IsOpen() || WadeWorld == nullptr)
	{
		return;
	}
	wade::Pacing Pacing;
	Pacing.substep = 1.0e-3 * Settings->SubstepMilliseconds;
	Pacing.budget_ns = 1000ull * uint64(Settings->BudgetMicroseconds);
	const TSharedRef<FWadeVehicle, ESPMode::ThreadSafe> Made = MakeShared<FWadeVehicle, ESPMode::ThreadSafe>(Link, Pacing);
	if (!WadeWorld->AddVehicle(Made))
	{
		return;
	}
	Acting = Made;
	Body->OnComponentPhysicsStateChanged.AddDynamic(this, &UWadeHydrodynamicsComponent::OnPhysicsStateChanged);
	SetLinkState(EWadeLinkState::Connecting);
}

void UWadeHydrodynamicsComponent::EndPlay(const EEndPlayReason::Type EndPlayReason)
{
	if (UPrimitiveComponent* Body = FindBody())
	{
		Body->OnComponentPhysicsStateChanged.RemoveDynamic(this, &UWadeHydrodynamicsComponent::OnPhysicsStateChanged);
	}
	UWadeWorld* WadeWorld = FindWadeWorld();
	if (Acting.IsValid() && WadeWorld != nullptr)
	{
		WadeWorld->RemoveVehicle(Acting);
	}
	Acting.Reset();
	Latest.Reset();
	SetLinkState(EWadeLinkState::Disconnected);
	Super::EndPlay(EndPlayReason);
}

void UWadeHydrodynamicsComponent::TickComponent(float DeltaTime, ELevelTick TickType, FActorComponentTickFunction* ThisTickFunction)
{
	Super::TickComponent(DeltaTime, TickType, ThisTickFunction);
	if (!Acting.IsValid() || FindWadeWorld() == nullptr)
	{
		return;
	}
	TakeOutput();
	FString Reason;
	if (Acting->Link->HasNewReason(DeltaTime, Reason))
	{
		UE_LOG(LogWade, Warning, TEXT("%s (%s): %s"), *GetOwner()->GetName(), *Vehicle, *Reason);
	}
	GiveInput();
	if (bDrawDebug && Latest.IsValid())
	{
		DrawWadeForces(GetWorld(), *Latest, DebugScale);
	}
}

void UWadeHydrodynamicsComponent::OnPhysicsStateChanged(UPrimitiveComponent* /*Changed*/, EComponentPhysicsStateChange Change)
{
	UWadeWorld* WadeWorld = FindWadeWorld();
	if (Acting.IsValid() && WadeWorld != nullptr && Change == EComponentPhysicsStateChange::Destroyed)
	{
		FWadeScene Scene;
		Scene.Vehicle = Acting;
		WadeWorld->SetScene(Scene);
	}
}

UWadeWorld* UWadeHydrodynamicsComponent::FindWadeWorld() const
{
	const UWorld* World = GetWorld();
	return World != nullptr ? World->GetSubsystem<UWadeWorld>() : nullptr;
}

UPrimitiveComponent* UWadeHydrodynamicsComponent::FindBody() const
{
	return Cast<UPrimitiveComponent>(GetOwner()->GetRootComponent());
}

bool UWadeHydrodynamicsComponent::SampleWaterAt(const FVector& Location, FWadeWaterSample& Sample) const
{
	switch (WaterSource)
	{
	case EWadeWaterSource::Actor:
		return WaterActor != nullptr && WaterActor->Implements<UWadeWaterSurface>()
			&& IWadeWaterSurface::Execute_SampleWater(WaterActor, Location, Sample);
	case EWadeWaterSource::Callback:
		return WaterCallback.IsBound() && WaterCallback.Execute(Location, Sample);
	default:
		Sample = Water;
		return true;
	}
}

double UWadeHydrodynamicsComponent::TraceBedAt(const FVector& Location) const
{
	FCollisionQueryParams Params;
	Params.AddIgnoredActor(GetOwner());
	if (WaterActor != nullptr)
	{
		Params.AddIgnoredActor(WaterActor.Get());
	}
	const FVector End = Location - FVector(0.0, 0.0, BedTraceLength);
	FHitResult Hit;
	return GetWorld()->LineTraceSingleByChannel(Hit, Location, End, BedTraceChannel, Params) ? Hit.ImpactPoint.Z : End.Z;
}

void UWadeHydrodynamicsComponent::TakeOutput()
{
	Latest = FindWadeWorld()->LatestReport(Acting);
	if (!Latest.IsValid())
	{
		return;
	}
	SetLinkState(Shown(Latest->Link));
	if (wade::is_answered(Latest->Link))
	{
		wade::Hull Hull;
		Hull.center_of_mass = Latest->CenterOfMass;
		Hull.z0 = wade::axes::meters_per_unit * GroundContactZ;
		Hull.radius = RadiusOf(HullRadius);
		Acting->Link->RefreshTable(Latest->BundleVersion, Hull);
	}
}

void UWadeHydrodynamicsComponent::GiveInput()
{
	FWadeScene Scene;
	Scene.Vehicle = Acting;
	const UPrimitiveComponent* Body = FindBody();
	FBodyInstance* Instance = Body != nullptr ? Body->GetBodyInstance(Bone) : nullptr;
	Scene.Proxy = Instance != nullptr ? Instance->GetPhysicsActorHandle() : nullptr;
	if (Body == nullptr || Scene.Proxy == nullptr)
	{
		FindWadeWorld()->SetScene(Scene);
		return;
	}
	Scene.HullInBody = HullInBody;
	Scene.Table = Acting->Link->Table();
	Scene.Beginnings = Beginnings;
	Scene.Surroundings.z0 = wade::axes::meters_per_unit * GroundContactZ;
	Scene.Surroundings.radius = RadiusOf(HullRadius);
	Scene.Surroundings.gravity = WadeAxes::FromUnreal(FVector(0.0, 0.0, GetWorld()->GetGravityZ()));
	Scene.Surroundings.dry_contact = bDryContact;
	Scene.Surroundings.session = 1 + Beginnings;
	Scene.Surroundings.bed = bBedShareStated ? std::optional<double>(BedShare) : std::nullopt;
	Scene.Surroundings.wheel_speeds.count = static_cast<std::uint32_t>(WheelSpeeds.Num());
	for (int32 Index = 0; Index < WheelSpeeds.Num(); ++Index)
	{
		Scene.Surroundings.wheel_speeds.speeds[static_cast<std::size_t>(Index)] = WheelSpeeds[Index];
	}
	const FVector Location = Body->GetComponentLocation();
	FWadeWaterSample Sample;
	Scene.bWater = SampleWaterAt(Location, Sample);
	Scene.Water.point = WadeAxes::FromUnreal(FVector(Location.X, Location.Y, Sample.Level));
	Scene.Water.normal = wade::axes::mirrored(WadeAxes::Plain(Sample.Normal.GetSafeNormal(UE_SMALL_NUMBER, FVector(0.0, 0.0, 1.0))));
	Scene.Water.current = WadeAxes::FromUnreal(Sample.Velocity);
	Scene.Water.density = Sample.Density;
	if (Scene.bWater && bTraceBed && !Sample.bBedKnown)
	{
		Sample.bBedKnown = true;
		Sample.BedHeight = TraceBedAt(Location);
	}
	Scene.Water.bed_height = Sample.bBedKnown ? std::optional<double>(wade::axes::meters_per_unit * Sample.BedHeight) : std::nullopt;
	FindWadeWorld()->SetScene(Scene);
}

void UWadeHydrodynamicsComponent::SetLinkState(EWadeLinkState State)
{
	if (State == LinkState)
	{
		return;
	}
	LinkState = State;
	const FString Name = UEnum::GetValueAsString(State);
	if (State == EWadeLinkState::Serving || !Acting.IsValid())
	{
		UE_LOG(LogWade, Log, TEXT("%s (%s): %s"), *GetOwner()->GetName(), *Vehicle, *Name);
	}
	else
	{
		UE_LOG(LogWade, Warning, TEXT("%s (%s): %s. %s"), *GetOwner()->GetName(), *Vehicle, *Name, *Acting->Link->Reason());
	}
	OnLinkStateChanged.Broadcast(State);
}

void UWadeHydrodynamicsComponent::SetWaterCallback(FWadeSampleWater Sampler)
{
	WaterCallback = Sampler;
	WaterSource = EWadeWaterSource::Callback;
}

void UWadeHydrodynamicsComponent::SetWheelSpeeds(double FrontLeft, double FrontRight, double RearLeft, double RearRight)
{
	WheelSpeeds = {FrontLeft, FrontRight, RearLeft, RearRight};
}

void UWadeHydrodynamicsComponent::SetAllWheelSpeeds(const TArray<double>& Speeds)
{
	if (Speeds.Num() > WADE_MAX_WHEELS)
	{
		UE_LOG(LogWade, Warning, TEXT("%d wheel speeds were set; %d are taken at most, and none of these is"), Speeds.Num(), WADE_MAX_WHEELS);
		WheelSpeeds.Reset();
		return;
	}
	WheelSpeeds = Speeds;
}

void UWadeHydrodynamicsComponent::BeginAnew()
{
	++Beginnings;
}

FVector UWadeHydrodynamicsComponent::GetNetForce() const
{
	return Latest.IsValid() ? Latest->Force : FVector::ZeroVector;
}

double UWadeHydrodynamicsComponent::GetWaterDepth() const
{
	return Latest.IsValid() ? Latest->DepthCm : 0.0;
}

double UWadeHydrodynamicsComponent::GetWaterLevel() const
{
	return Latest.IsValid() ? Latest->LevelCm : 0.0;
}

double UWadeHydrodynamicsComponent::GetBedClearance() const
{
	return Latest.IsValid() ? Latest->BedClearanceCm : 0.0;
}

double UWadeHydrodynamicsComponent::GetDepthOutsideDomain() const
{
	return Latest.IsValid() ? Latest->DepthOutsideCm : 0.0;
}

void UWadeHydrodynamicsComponent::ReadFromServer()
{
	const FString& Endpoint = GetDefault<UWadeSettings>()->Endpoint;
	if (!FWadeModule::IsLibraryLoaded())
	{
		return;
	}
	wade_vehicle Answer{};
	std::string Reason;
	if (wade::ask_vehicle(WadeConnection(Endpoint, Vehicle), VehicleTimeoutNs, Answer, Reason) != WADE_STATUS_OK)
	{
		UE_LOG(LogWade, Error, TEXT("%s of %s: %s"), *Vehicle, *Endpoint, UTF8_TO_TCHAR(Reason.c_str()));
		return;
	}
	Modify();
	GroundContactZ = Answer.z0_m / wade::axes::meters_per_unit;
	// the frame's origin is the middle of the box around the hull
	HullRadius = 0.5 * wade::norm({Answer.length_m, Answer.width_m, Answer.height_m}) / wade::axes::meters_per_unit;
	UE_LOG(LogWade, Log, TEXT("%s: ground contact at %.2f cm; the vehicle file has a mass of %.1f kg, to be set on the body."), *Vehicle, GroundContactZ, Answer.mass_kg);
}
