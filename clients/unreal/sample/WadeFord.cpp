#include "WadeFord.h"

#include "Components/BoxComponent.h"
#include "Components/StaticMeshComponent.h"
#include "Engine/StaticMesh.h"
#include "UObject/ConstructorHelpers.h"
#include "WadeHydrodynamicsComponent.h"

AWadeFordStream::AWadeFordStream()
{
	SetRootComponent(CreateDefaultSubobject<USceneComponent>(TEXT("Root")));
}

bool AWadeFordStream::SampleWater_Implementation(const FVector& Location, FWadeWaterSample& Sample) const
{
	const FTransform& Here = GetActorTransform();
	const double Across = 2.0 * Here.InverseTransformPositionNoScale(Location).X / StreamWidth;
	// 1 in the middle, 0 at the banks
	const double Share = 1.0 - Across * Across;
	if (Share <= 0.0)
	{
		return false;
	}
	Sample.Level = Here.GetLocation().Z;
	Sample.Velocity = Here.TransformVectorNoScale(FVector(0.0, Share * StreamSpeed, 0.0));
	Sample.bBedKnown = true;
	Sample.BedHeight = Sample.Level - Share * StreamDepth;
	return true;
}

AWadeFordRover::AWadeFordRover()
{
	// length, width and height of a Husky [cm], its mass [kg] and the height of its center of mass over the middle of its hull [cm]
	const FVector Size(86.8, 68.5, 36.9);
	constexpr float MassKg = 50.0f;
	constexpr double CenterOfMassZ = 1.33;

	PrimaryActorTick.bCanEverTick = true;

	Hull = CreateDefaultSubobject<UBoxComponent>(TEXT("Hull"));
	Hull->SetBoxExtent(0.5 * Size);
	Hull->SetCollisionProfileName(TEXT("PhysicsActor"));
	Hull->SetSimulatePhysics(true);
	Hull->SetMassOverrideInKg(NAME_None, MassKg);
	Hull->SetCenterOfMass(FVector(0.0, 0.0, CenterOfMassZ));
	SetRootComponent(Hull);

	// what is seen: the engine's cube of 1 m
	Shape = CreateDefaultSubobject<UStaticMeshComponent>(TEXT("Shape"));
	Shape->SetupAttachment(Hull);
	Shape->SetCollisionEnabled(ECollisionEnabled::NoCollision);
	Shape->SetRelativeScale3D(0.01 * Size);
	static ConstructorHelpers::FObjectFinder<UStaticMesh> Cube(TEXT("/Engine/BasicShapes/Cube.Cube"));
	if (Cube.Succeeded())
	{
		Shape->SetStaticMesh(Cube.Object);
	}

	Hydrodynamics = CreateDefaultSubobject<UWadeHydrodynamicsComponent>(TEXT("Hydrodynamics"));
	Hydrodynamics->Vehicle = TEXT("husky");
	Hydrodynamics->GroundContactZ = -0.5 * Size.Z;
	Hydrodynamics->HullRadius = 0.5 * Size.Size();
	Hydrodynamics->bDrawDebug = true;
}

void AWadeFordRover::BeginPlay()
{
	// before the components begin
	Hydrodynamics->WaterSource = Stream != nullptr ? EWadeWaterSource::Actor : EWadeWaterSource::Constant;
	Hydrodynamics->WaterActor = Stream;
	Hydrodynamics->Water.Level = WaterHeight;
	Super::BeginPlay();
}

void AWadeFordRover::Tick(float DeltaSeconds)
{
	Super::Tick(DeltaSeconds);
	// in kg cm/s2 and kg cm2/s2
	Hull->AddForce(100.0 * Thrust * Hull->GetForwardVector());
	Hull->AddTorqueInRadians(1.0e4 * Turn * Hull->GetUpVector());
}
