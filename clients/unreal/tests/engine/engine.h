// Stand-ins for the declarations of the engine that the plugin uses, in our own words, as strict as those of Unreal Engine 5.3 to
// 5.7 as far as public sources show them (clients/unreal/README.md). They do nothing and are no engine: that the plugin parses
// against them proves its syntax and its agreement with these signatures, nothing else.

#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <type_traits>

using int32 = std::int32_t;
using uint32 = std::uint32_t;
using uint64 = std::uint64_t;
using uint8 = std::uint8_t;
using TCHAR = char16_t;
using ANSICHAR = char;

#define TEXT(literal) u##literal
#define UCLASS(...)
#define USTRUCT(...)
#define UENUM(...)
#define UINTERFACE(...)
#define UPROPERTY(...)
#define UFUNCTION(...)
// what the header tool writes: nothing that the plugin uses, but for the interface, where `test` puts it
#define GENERATED_BODY() private:
#define GENERATED_WATER_SURFACE                                                                            \
 public:                                                                                                   \
  static bool Execute_SampleWater(const UObject* object, const FVector& location, FWadeWaterSample& sample); \
  virtual bool SampleWater_Implementation(const FVector& location, FWadeWaterSample& sample) const;
#define WADE_API
#define PLATFORM_WINDOWS 0
#define PLATFORM_MAC 0
#define PLATFORM_CPU_ARM_FAMILY 0
#define ENABLE_DRAW_DEBUG 1
#define UE_SMALL_NUMBER (1.e-8)
#define DECLARE_LOG_CATEGORY_EXTERN(name, ...) extern int name
#define DEFINE_LOG_CATEGORY(name) int name
#define IMPLEMENT_MODULE(module, name) static_assert(sizeof(module) > 0);
#define UE_LOG(category, verbosity, format, ...) engine_log(category, format __VA_OPT__(, ) __VA_ARGS__)
#define UTF8_TO_TCHAR(text) FUTF8ToTCHAR(text).Get()
#define TCHAR_TO_UTF8(text) FTCHARToUTF8(text).Get()
#define DECLARE_DYNAMIC_DELEGATE_RetVal_TwoParams(result, name, first, first_name, second, second_name) \
  struct name {                                                                                         \
    bool IsBound() const;                                                                               \
    result Execute(first, second) const;                                                                \
  }
#define DECLARE_DYNAMIC_MULTICAST_DELEGATE_OneParam(name, first, first_name) \
  struct name {                                                              \
    void Broadcast(first);                                                   \
  }

template <typename... Arguments>
void engine_log(int category, const TCHAR* format, Arguments... arguments);

class FString {
 public:
  FString();
  FString(const TCHAR* text);
  const TCHAR* operator*() const;
  template <typename... Arguments>
  static FString Printf(const TCHAR* format, Arguments... arguments);
  bool StartsWith(const TCHAR* prefix) const;
};
FString operator+(const TCHAR* a, const FString& b);
FString operator+(FString&& a, const FString& b);
FString operator+(const FString& a, const TCHAR* b);
class FStringView {
 public:
  FStringView(const TCHAR* text);
};

enum EName { NAME_None };
class FName {
 public:
  FName(EName name = NAME_None);
  FName(const TCHAR* text);
};
class FUTF8ToTCHAR {
 public:
  explicit FUTF8ToTCHAR(const char* text);
  const TCHAR* Get() const;
};
class FTCHARToUTF8 {
 public:
  explicit FTCHARToUTF8(const TCHAR* text);
  const ANSICHAR* Get() const;
};

struct FVector {
  double X, Y, Z;
  FVector();
  FVector(double x, double y, double z);
  static const FVector ZeroVector;
  double Size() const;
  FVector GetSafeNormal(double tolerance, const FVector& result_if_zero) const;
};
FVector operator+(const FVector& a, const FVector& b);
FVector operator-(const FVector& a, const FVector& b);
FVector operator*(double s, const FVector& v);
struct FQuat {
  double X, Y, Z, W;
  FQuat Inverse() const;
  FVector RotateVector(const FVector& v) const;
};
FQuat operator*(const FQuat& a, const FQuat& b);
struct FTransform {
  static const FTransform Identity;
  FQuat GetRotation() const;
  FVector GetLocation() const;
  FVector InverseTransformPositionNoScale(const FVector& v) const;
  FVector TransformVectorNoScale(const FVector& v) const;
};
struct FPlane {
  FPlane(const FVector& base, const FVector& normal);
};
struct FColor {
  FColor(uint8 r, uint8 g, uint8 b, uint8 a = 255);
  static const FColor Cyan, Red, Yellow, White;
};

template <typename T>
class TArray {
 public:
  TArray();
  TArray(std::initializer_list<T> items);
  int32 Num() const;
  void Reset();
  int32 Add(const T& item);
  const T& operator[](int32 index) const;
  T* begin();
  T* end();
  const T* begin() const;
  const T* end() const;
  template <typename Predicate>
  int32 RemoveAll(const Predicate& predicate) {
    return predicate(*begin()) ? 1 : 0;
  }
  template <typename Predicate>
  T* FindByPredicate(Predicate predicate) {
    return predicate(*begin()) ? begin() : nullptr;
  }
};
template <typename T>
std::remove_reference_t<T>&& MoveTemp(T&& value);
template <typename T>
class TObjectPtr {
 public:
  TObjectPtr();
  TObjectPtr(T* object);
  T* operator->() const;
  operator T*() const;
  T* Get() const;
};
template <typename T>
class TEnumAsByte {
 public:
  TEnumAsByte(T value);
  operator T() const;
};
enum class ESPMode { NotThreadSafe, ThreadSafe };
template <typename T, ESPMode mode = ESPMode::ThreadSafe>
class TSharedRef {
 public:
  explicit TSharedRef(T* made);
  TSharedRef(const TSharedRef& other);
  T* operator->() const;
  T& operator*() const;
  T& Get() const;
};
template <typename T, ESPMode mode = ESPMode::ThreadSafe>
class TSharedPtr {
 public:
  TSharedPtr();
  TSharedPtr(std::nullptr_t);
  TSharedPtr(const TSharedRef<T, mode>& reference);
  T* operator->() const;
  T& operator*() const;
  T* Get() const;
  bool IsValid() const;
  void Reset();
};
template <typename T, typename U, ESPMode mode>
bool operator==(const TSharedPtr<T, mode>& a, const TSharedPtr<U, mode>& b);
template <typename T, ESPMode mode = ESPMode::ThreadSafe, typename... Arguments>
TSharedRef<T, mode> MakeShared(Arguments&&... arguments) {
  return TSharedRef<T, mode>(new T(static_cast<Arguments&&>(arguments)...));
}
template <typename T>
class TFuture {
 public:
  TFuture();
  bool IsValid() const;
  bool IsReady() const;
  T Get() const;
  void Reset();
};
enum class EAsyncExecution { ThreadPool };
template <typename Callable>
auto Async(EAsyncExecution, Callable&& callable) -> TFuture<decltype(callable())> {
  return {};
}

class UObject {
 public:
  virtual ~UObject();
  FString GetName() const;
  bool Modify(bool always_mark_dirty = true);
  template <typename T>
  bool Implements() const;
};
class UInterface : public UObject {};
struct FWadeWaterSample;
template <typename To, typename From>
To* Cast(From* from);
template <typename T>
const T* GetDefault();
struct UEnum {
  template <typename T>
  static FString GetValueAsString(T value);
};

class UDeveloperSettings : public UObject {
 public:
  virtual FName GetCategoryName() const;
};

namespace Chaos {
using FReal = double;
using FRealSingle = float;
struct FVec3 : FVector {
  FVec3(const FVector& v);
};
template <typename T>
struct TVec3 {
  T X, Y, Z;
};
struct FRotation3 : FQuat {};
enum class EObjectStateType : int8_t { Uninitialized, Sleeping, Kinematic, Static, Dynamic, Count };
class FRigidBodyHandle_Internal;
class FSingleParticlePhysicsProxy {
 public:
  FRigidBodyHandle_Internal* GetPhysicsThreadAPI();
  const FRigidBodyHandle_Internal* GetPhysicsThreadAPI() const;

 protected:
  FSingleParticlePhysicsProxy();
};
template <bool External>
class TThreadedSingleParticlePhysicsProxyBase : protected FSingleParticlePhysicsProxy {
 public:
  TThreadedSingleParticlePhysicsProxyBase() = delete;
  const FVec3& X() const;
  FRotation3 R() const;  // a reference in 5.3
  const FVec3 V() const;
  const FVec3 W() const;
  FReal M() const;
  const TVec3<FRealSingle> I() const;
  const FVec3 CenterOfMass() const;
  const FRotation3 RotationOfMass() const;
  EObjectStateType ObjectState() const;
  void AddForce(const FVec3& force, bool invalidate = true);
  void AddTorque(const FVec3& torque, bool invalidate = true);
};
class FRigidBodyHandle_Internal : public TThreadedSingleParticlePhysicsProxyBase<false> {
  FRigidBodyHandle_Internal() = delete;
};
struct FSimCallbackInput {
  FSimCallbackInput();

 protected:
  virtual ~FSimCallbackInput();
};
struct FSimCallbackOutput {
  FSimCallbackOutput();
  FReal InternalTime;

 protected:
  ~FSimCallbackOutput();
};
enum class ESimCallbackOptions : std::uint16_t { Presimulate = 1 };
class ISimCallbackObject;
class FSimCallbackOutputHandle {
 public:
  FSimCallbackOutputHandle(const FSimCallbackOutputHandle&) = delete;
  FSimCallbackOutputHandle(FSimCallbackOutputHandle&&);
  ~FSimCallbackOutputHandle();
  operator bool() const;
};
template <typename T>
class TSimCallbackOutputHandle : public FSimCallbackOutputHandle {
 public:
  T* operator->();
  const T* operator->() const;
};
class ISimCallbackObject {
 public:
  virtual ~ISimCallbackObject() = default;
  ISimCallbackObject(const ISimCallbackObject&) = delete;
  FReal GetDeltaTime_Internal() const;
  virtual void FreeOutputData_External(FSimCallbackOutput* output) = 0;
  virtual void FreeInputData_Internal(FSimCallbackInput* input) = 0;
  virtual FName GetFNameForStatId() const;

 protected:
  explicit ISimCallbackObject(ESimCallbackOptions options);

 private:
  virtual FSimCallbackInput* AllocateInputData_External() = 0;
  virtual void OnPreSimulate_Internal() = 0;
};
template <typename Input, typename Output, ESimCallbackOptions options = ESimCallbackOptions::Presimulate>
class TSimCallbackObject : public ISimCallbackObject {
 public:
  TSimCallbackObject() : ISimCallbackObject(options) {}
  void FreeOutputData_External(FSimCallbackOutput* output) override { static_cast<Output*>(output)->Reset(); }
  Input* GetProducerInputData_External();
  const Input* GetConsumerInput_Internal() const;
  TSimCallbackOutputHandle<Output> PopOutputData_External();
  Output& GetProducerOutputData_Internal();

 private:
  void FreeInputData_Internal(FSimCallbackInput* input) override { static_cast<Input*>(input)->Reset(); }
  FSimCallbackInput* AllocateInputData_External() override { return new Input(); }
};
class FPhysicsSolverBase {
 public:
  template <typename T>
  T* CreateAndRegisterSimCallbackObject_External() {
    return new T();
  }
  void UnregisterAndFreeSimCallbackObject_External(ISimCallbackObject* object);
};
class FPBDRigidsSolver : public FPhysicsSolverBase {};
using FPhysicsSolver = FPBDRigidsSolver;
}  // namespace Chaos

using FPhysicsActorHandle = Chaos::FSingleParticlePhysicsProxy*;
class FChaosScene {
 public:
  Chaos::FPhysicsSolver* GetSolver() const;
};
class FPhysScene_Chaos : public FChaosScene {};
using FPhysScene = FPhysScene_Chaos;
struct FBodyInstance {
  FPhysicsActorHandle& GetPhysicsActorHandle();
  const FPhysicsActorHandle& GetPhysicsActorHandle() const;
};

enum ECollisionChannel : int { ECC_WorldStatic, ECC_Visibility };
class AActor;
struct FCollisionQueryParams {
  void AddIgnoredActor(const AActor* actor);
};
struct FHitResult {
  FVector ImpactPoint;
};

class UWorldSubsystem;
class UWorld : public UObject {
 public:
  bool LineTraceSingleByChannel(FHitResult& hit, const FVector& start, const FVector& end, ECollisionChannel channel,
                                const FCollisionQueryParams& params) const;
  FPhysScene* GetPhysicsScene() const;
  float GetGravityZ() const;
  template <typename T>
  T* GetSubsystem() const {
    static_assert(std::is_base_of_v<UWorldSubsystem, T>);
    return nullptr;
  }
};
class FSubsystemCollectionBase;
class USubsystem : public UObject {
 public:
  virtual void Initialize(FSubsystemCollectionBase& collection);
  virtual void Deinitialize();
};
class UWorldSubsystem : public USubsystem {
 public:
  // what the header tool writes into the derived class
  using Super = UWorldSubsystem;
  virtual UWorld* GetWorld() const;
};
namespace ECollisionEnabled {
enum Type : int { NoCollision };
}
enum class EComponentPhysicsStateChange : uint8 { Created, Destroyed };
class UPrimitiveComponent;
struct FComponentPhysicsStateChanged {
  // macros of the engine, which look for the name of the function
  template <typename T>
  void AddDynamic(T* object, void (T::*function)(UPrimitiveComponent*, EComponentPhysicsStateChange));
  template <typename T>
  void RemoveDynamic(T* object, void (T::*function)(UPrimitiveComponent*, EComponentPhysicsStateChange));
};
enum ETickingGroup { TG_PrePhysics };
enum ELevelTick { LEVELTICK_All };
struct FTickFunction {
  bool bCanEverTick;
  ETickingGroup TickGroup;
};
struct FActorComponentTickFunction : FTickFunction {};
struct FActorTickFunction : FTickFunction {};
namespace EEndPlayReason {
enum Type { Destroyed };
}
class UActorComponent : public UObject {
 public:
  // what the header tool writes into the derived class
  using Super = UActorComponent;
  FActorComponentTickFunction PrimaryComponentTick;
  AActor* GetOwner() const;
  virtual UWorld* GetWorld() const;
  virtual void BeginPlay();
  virtual void EndPlay(const EEndPlayReason::Type reason);
  virtual void TickComponent(float time, ELevelTick type, FActorComponentTickFunction* function);
};
class USceneComponent : public UActorComponent {
 public:
  FVector GetComponentLocation() const;
  FVector GetForwardVector() const;
  FVector GetUpVector() const;
  void SetupAttachment(USceneComponent* parent, FName socket = NAME_None);
  void SetRelativeScale3D(FVector scale);
};
class UPrimitiveComponent : public USceneComponent {
 public:
  FComponentPhysicsStateChanged OnComponentPhysicsStateChanged;
  virtual FBodyInstance* GetBodyInstance(FName bone = NAME_None, bool get_welded = true, int32 index = -1) const;
  virtual void SetCollisionEnabled(ECollisionEnabled::Type type);
  virtual void SetCollisionProfileName(FName profile, bool update_overlaps = true);
  virtual void SetSimulatePhysics(bool simulate);
  virtual void SetMassOverrideInKg(FName bone = NAME_None, float mass = 1.0F, bool override_mass = true);
  virtual void SetCenterOfMass(FVector offset, FName bone = NAME_None);
  virtual void AddForce(FVector force, FName bone = NAME_None, bool change_acceleration = false);
  virtual void AddTorqueInRadians(FVector torque, FName bone = NAME_None, bool change_acceleration = false);
};
class UBoxComponent : public UPrimitiveComponent {
 public:
  void SetBoxExtent(FVector extent, bool update_overlaps = true);
};
class UStaticMesh : public UObject {};
class UStaticMeshComponent : public UPrimitiveComponent {
 public:
  virtual bool SetStaticMesh(UStaticMesh* mesh);
};
struct ConstructorHelpers {
  template <typename T>
  struct FObjectFinder {
    FObjectFinder(const TCHAR* path);
    T* Object;
    bool Succeeded() const;
  };
};
class AActor : public UObject {
 public:
  using Super = AActor;
  FActorTickFunction PrimaryActorTick;
  USceneComponent* GetRootComponent() const;
  bool SetRootComponent(USceneComponent* component);
  const FTransform& GetActorTransform() const;
  template <typename T>
  T* CreateDefaultSubobject(FName) {
    return new T();
  }
  virtual void BeginPlay();
  virtual void Tick(float time);
};

class IModuleInterface {
 public:
  virtual ~IModuleInterface();
  virtual void StartupModule();
  virtual void ShutdownModule();
};
struct FModuleManager {
  template <typename T>
  static T& GetModuleChecked(const TCHAR* name);
};
class IPlugin {
 public:
  FString GetBaseDir() const;
};
class IPluginManager {
 public:
  static IPluginManager& Get();
  virtual TSharedPtr<IPlugin> FindPlugin(const FStringView name) = 0;
  virtual TSharedPtr<IPlugin> FindPlugin(const ANSICHAR* name) = 0;
};
struct FPaths {
  template <typename... Parts>
  static FString Combine(const Parts&... parts);
};
struct FPlatformProcess {
  static void* GetDllHandle(const TCHAR* name);
  static void FreeDllHandle(void* handle);
};
struct FPlatformTime {
  static double Seconds();
};

void DrawDebugDirectionalArrow(const UWorld* world, const FVector& start, const FVector& end, float size,
                               const FColor& color, bool persistent, float life, uint8 priority, float thickness);
void DrawDebugSolidPlane(const UWorld* world, const FPlane& plane, const FVector& place, float size, const FColor& color,
                         bool persistent, float life, uint8 priority);
void DrawDebugString(const UWorld* world, const FVector& place, const FString& text, AActor* actor, const FColor& color,
                     float duration);
