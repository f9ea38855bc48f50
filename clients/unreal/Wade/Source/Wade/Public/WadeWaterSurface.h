// Where the water is: what a body of water tells a vehicle.

#pragma once

#include "CoreMinimal.h"
#include "UObject/Interface.h"
#include "WadeWaterSurface.generated.h"

/** The water at a place, world. */
USTRUCT(BlueprintType)
struct WADE_API FWadeWaterSample
{
	GENERATED_BODY()

	/** Height of the surface, world z [cm]. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade")
	double Level = 0.0;

	/** Upward normal of the surface. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade")
	FVector Normal = FVector(0.0, 0.0, 1.0);

	/** Velocity of the water [cm/s]. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade")
	FVector Velocity = FVector(0.0, 0.0, 0.0);

	/** [kg/m3] */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade")
	double Density = 1000.0;

	/** Whether BedHeight holds a height. Where it does not, the component's trace finds it, if that is on; else the server takes
	 *  the vehicle to stand on the bed until it floats. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade", meta = (InlineEditConditionToggle))
	bool bBedKnown = false;

	/** Height of the bed under the place, world z [cm]: the level less the depth of the water. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade", meta = (EditCondition = "bBedKnown"))
	double BedHeight = 0.0;
};

UINTERFACE(BlueprintType, Blueprintable, MinimalAPI)
class UWadeWaterSurface : public UInterface
{
	GENERATED_BODY()
};

/** A body of water, implemented by an actor in C++ or Blueprint. Asked on the game thread, once a frame and vehicle. */
class WADE_API IWadeWaterSurface
{
	GENERATED_BODY()

public:
	/** The water under or over a location; false where there is none. The bed's height may be left out. */
	UFUNCTION(BlueprintNativeEvent, BlueprintCallable, Category = "Wade")
	bool SampleWater(const FVector& Location, FWadeWaterSample& Sample) const;
};
