// A ford: a stream with a bed, and a body of a Husky's size and mass that is pushed through it. To be copied into a C++ project whose
// Build.cs names the module Wade; see clients/unreal/README.md.

#pragma once

#include "CoreMinimal.h"
#include "GameFramework/Actor.h"
#include "WadeWaterSurface.h"
#include "WadeFord.generated.h"

class UBoxComponent;
class UStaticMeshComponent;
class UWadeHydrodynamicsComponent;

/** Water along the actor's y axis, between two banks, deepest in the middle. */
UCLASS()
class AWadeFordStream : public AActor, public IWadeWaterSurface
{
	GENERATED_BODY()

public:
	AWadeFordStream();

	/** Distance from bank to bank [cm]. */
	UPROPERTY(EditAnywhere, Category = "Wade", meta = (ClampMin = "1"))
	double StreamWidth = 1200.0;

	/** Depth in the middle [cm]; the surface is at the height of the actor. */
	UPROPERTY(EditAnywhere, Category = "Wade", meta = (ClampMin = "0"))
	double StreamDepth = 80.0;

	/** Speed of the water in the middle [cm/s]. */
	UPROPERTY(EditAnywhere, Category = "Wade")
	double StreamSpeed = 50.0;

	virtual bool SampleWater_Implementation(const FVector& Location, FWadeWaterSample& Sample) const override;
};

/** A box that floats, with a thrust along its x axis in place of wheels. */
UCLASS()
class AWadeFordRover : public AActor
{
	GENERATED_BODY()

public:
	AWadeFordRover();

	/** The stream to cross. Without it the water is level with `WaterHeight` everywhere. */
	UPROPERTY(EditAnywhere, Category = "Wade")
	TObjectPtr<AActor> Stream;

	/** World z [cm]. */
	UPROPERTY(EditAnywhere, Category = "Wade")
	double WaterHeight = 0.0;

	/** [N] */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade")
	double Thrust = 40.0;

	/** Moment about its z axis, positive to the right [N m]. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade")
	double Turn = 0.0;

	virtual void BeginPlay() override;
	virtual void Tick(float DeltaSeconds) override;

private:
	UPROPERTY(VisibleAnywhere, Category = "Wade")
	TObjectPtr<UBoxComponent> Hull;

	UPROPERTY(VisibleAnywhere, Category = "Wade")
	TObjectPtr<UStaticMeshComponent> Shape;

	UPROPERTY(VisibleAnywhere, Category = "Wade")
	TObjectPtr<UWadeHydrodynamicsComponent> Hydrodynamics;
};
