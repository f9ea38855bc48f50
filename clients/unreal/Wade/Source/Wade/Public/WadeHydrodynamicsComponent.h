// Put on a vehicle, it lets the water of a wade server act on the vehicle's body, in the physics thread.

#pragma once

#include "Components/ActorComponent.h"
#include "Components/PrimitiveComponent.h"
#include "CoreMinimal.h"
#include "Engine/EngineTypes.h"
#include "Templates/SharedPointer.h"
#include "WadeWaterSurface.h"
#include "WadeHydrodynamicsComponent.generated.h"

class FWadeVehicle;
class UWadeWorld;
struct FWadeReport;

/** Who says where the water is. */
UENUM(BlueprintType)
enum class EWadeWaterSource : uint8
{
	/** `Water` of this component, everywhere. */
	Constant,
	/** `WaterActor`, which implements IWadeWaterSurface. */
	Actor,
	/** What `SetWaterCallback` was given. */
	Callback,
};

/** How the talk with the server stands. */
UENUM(BlueprintType)
enum class EWadeLinkState : uint8
{
	/** The client library is missing, or the component has not begun play. */
	Disconnected,
	/** Not answered yet; no force acts. */
	Connecting,
	/** Answers come in time. */
	Serving,
	/** Answers come late, or not for a moment; the last one is carried on. */
	Stale,
	/** The server is gone; the vehicle floats by its table of rest loads, and drag fades. */
	Lost,
	/** The server serves no vehicle of this name. */
	UnknownVehicle,
	/** Server and plugin are not of one version. */
	Incompatible,
	/** The server refuses what it is asked; see the log. */
	Refused,
};

DECLARE_DYNAMIC_DELEGATE_RetVal_TwoParams(bool, FWadeSampleWater, const FVector&, Location, FWadeWaterSample&, Sample);
DECLARE_DYNAMIC_MULTICAST_DELEGATE_OneParam(FWadeLinkStateChanged, EWadeLinkState, State);

UCLASS(ClassGroup = (Physics), meta = (BlueprintSpawnableComponent))
class WADE_API UWadeHydrodynamicsComponent : public UActorComponent
{
	GENERATED_BODY()

public:
	UWadeHydrodynamicsComponent();

	/** Name of the vehicle on the server. */
	UPROPERTY(EditAnywhere, BlueprintReadOnly, Category = "Wade")
	FString Vehicle = TEXT("husky");

	/** Bone of the body that the water acts on; none for the root component's own. */
	UPROPERTY(EditAnywhere, BlueprintReadOnly, Category = "Wade")
	FName Bone = NAME_None;

	/** Where the hull's frame of the vehicle file (x forward, y left, z up; middle of the hull) lies in the body's own frame.
	 *  Its rotation is that of a mesh that does not face along its x. */
	UPROPERTY(EditAnywhere, BlueprintReadOnly, Category = "Wade")
	FTransform HullInBody = FTransform::Identity;

	/** z of the ground-contact plane in the hull's frame: z0_m of the vehicle file, in cm. "Read From Server" fills it in. */
	UPROPERTY(EditAnywhere, BlueprintReadOnly, Category = "Wade")
	double GroundContactZ = -18.45;

	/** No point of the hull is further from its middle [cm]: higher above the water the server is not asked. 0 where it is not
	 *  known: the server is asked at any height. "Read From Server" fills it in. */
	UPROPERTY(EditAnywhere, BlueprintReadOnly, Category = "Wade", meta = (ClampMin = "0"))
	double HullRadius = 0.0;

	/** No water pressure under the tires' contact patches. */
	UPROPERTY(EditAnywhere, BlueprintReadOnly, Category = "Wade")
	bool bDryContact = false;

	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade|Water")
	EWadeWaterSource WaterSource = EWadeWaterSource::Constant;

	/** The water of the source Constant; the others say theirs themselves. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade|Water")
	FWadeWaterSample Water;

	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade|Water")
	TObjectPtr<AActor> WaterActor;

	/** Where the water's sample does not know the bed, a line trace straight down from the body finds it, once a frame. What
	 *  blocks the trace channel is bed, but the vehicle's own actor and WaterActor. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade|Water")
	bool bTraceBed = false;

	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade|Water", meta = (EditCondition = "bTraceBed"))
	TEnumAsByte<ECollisionChannel> BedTraceChannel = ECC_Visibility;

	/** Length of the trace [cm]. A bed that is not hit is taken to lie at its end, where a vehicle hardly feels it. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade|Water", meta = (EditCondition = "bTraceBed", ClampMin = "0"))
	double BedTraceLength = 2000.0;

	/** Whether BedShare holds a share. Else the server computes it from the velocities of vehicle and water. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade|Water", meta = (InlineEditConditionToggle))
	bool bBedShareStated = false;

	/** Share of the motion through the water that is motion over the bed: 0 parked in a current, 1 driving in still water. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade|Water", meta = (EditCondition = "bBedShareStated", ClampMin = "0", ClampMax = "1"))
	double BedShare = 0.5;

	/** Draws the force on each surface, the net force and the water plane. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade|Debug")
	bool bDrawDebug = false;

	/** Length of a drawn force [cm/N]. */
	UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Wade|Debug", meta = (ClampMin = "0"))
	float DebugScale = 0.5f;

	/** On the game thread, whenever it changes. */
	UPROPERTY(BlueprintAssignable, Category = "Wade")
	FWadeLinkStateChanged OnLinkStateChanged;

	/** Sets the source Callback: asked on the game thread, once a frame. */
	UFUNCTION(BlueprintCallable, Category = "Wade")
	void SetWaterCallback(FWadeSampleWater Sampler);

	/** Speeds of the wheels, front left, front right, rear left, rear right [rad/s], positive when driving forward. */
	UFUNCTION(BlueprintCallable, Category = "Wade")
	void SetWheelSpeeds(double FrontLeft, double FrontRight, double RearLeft, double RearRight);

	/** Speeds of the wheels of a vehicle with other wheels than four, by axle from the front, left before right [rad/s], positive
	 * when driving forward. Empty: not known. */
	UFUNCTION(BlueprintCallable, Category = "Wade")
	void SetAllWheelSpeeds(const TArray<double>& Speeds);

	/** To be called after a teleport or a velocity that was set: else it is taken for a force. */
	UFUNCTION(BlueprintCallable, Category = "Wade")
	void BeginAnew();

	UFUNCTION(BlueprintPure, Category = "Wade")
	EWadeLinkState GetLinkState() const { return LinkState; }

	/** Mean net force of the last physics step that is known here, world [N]. */
	UFUNCTION(BlueprintPure, Category = "Wade")
	FVector GetNetForce() const;

	/** Water surface above the ground-contact plane at the middle of the hull [cm]; negative where it is below. Says nothing of a
	 *  vehicle on its side or its back. */
	UFUNCTION(BlueprintPure, Category = "Wade")
	double GetWaterDepth() const;

	/** Water surface above the middle of the hull, in any attitude [cm]; negative where it is below. */
	UFUNCTION(BlueprintPure, Category = "Wade")
	double GetWaterLevel() const;

	/** Distance from the ground-contact plane to the bed that the server's last answer rests on [cm]; 0 before it. */
	UFUNCTION(BlueprintPure, Category = "Wade")
	double GetBedClearance() const;

	/** How far the depth lies outside the server's training domain [cm]: negative below, positive above, 0 within. Forces there
	 *  are a guess, which in deep water may be far too large. */
	UFUNCTION(BlueprintPure, Category = "Wade")
	double GetDepthOutsideDomain() const;

	/** Fills in GroundContactZ and HullRadius from the running server, over gRPC. */
	UFUNCTION(CallInEditor, Category = "Wade")
	void ReadFromServer();

	virtual void BeginPlay() override;
	virtual void EndPlay(const EEndPlayReason::Type EndPlayReason) override;
	virtual void TickComponent(float DeltaTime, ELevelTick TickType, FActorComponentTickFunction* ThisTickFunction) override;

private:
	/** Takes the body back from the physics thread when it ends. */
	UFUNCTION()
	void OnPhysicsStateChanged(UPrimitiveComponent* Changed, EComponentPhysicsStateChange Change);

	UPrimitiveComponent* FindBody() const;
	bool SampleWaterAt(const FVector& Location, FWadeWaterSample& Sample) const;
	double TraceBedAt(const FVector& Location) const;
	void TakeOutput();
	void GiveInput();
	void SetLinkState(EWadeLinkState State);

	UWadeWorld* FindWadeWorld() const;

	/** Null where the water does not act: out of play, or without the client library. */
	TSharedPtr<FWadeVehicle, ESPMode::ThreadSafe> Acting;
	/** Of the last step that is known here; null before it. */
	TSharedPtr<FWadeReport> Latest;
	EWadeLinkState LinkState = EWadeLinkState::Disconnected;
	FWadeSampleWater WaterCallback;
	TArray<double> WheelSpeeds;
	uint32 Beginnings = 0;
};
