// Stand-ins for the declarations of the engine that the plugin uses, written from the public API documentation (the pages are
// listed in clients/unreal/README.md). They do nothing and are no engine: that the plugin parses against them proves
// its syntax and its agreement with these signatures, nothing else.

#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>

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
// the header tool's own: a function that calls a Blueprint's
#define GENERATED_BODY()           \
 public:                           \
  template <typename... Arguments> \
  static bool Execute_SampleWater(Arguments&&...);
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
};
FString operator+(const TCHAR* a, const FString& b);

enum EName { NAME_None };
class FName {
 public:
  FName(EName name = NAME_None);
  explicit FName(const TCHAR* text);
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
};
template <typename T>
class TObjectPtr {
 public:
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
class TSharedPtr {
 public:
  TSharedPtr();
  TSharedPtr(std::nullptr_t);
  T* operator->() const;
  T& operator*() const;
  T* Get() const;
  bool IsValid() const;
  void Reset();
};
template <typename T, ESPMode mode = ESPMode::ThreadSafe, typename... Arguments>
TSharedPtr<T, mode> MakeShared(Arguments&&...);
template <typename T>
class TUniquePtr {
 public:
  TUniquePtr();
  T* operator->() const;
  explicit operator bool() const;
};
template <typename T, typename... Arguments>
TUniquePtr<T> MakeUnique(Arguments&&... arguments) {
  T made(static_cast<Arguments&&>(arguments)...);
  return {};
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
enum class EObjectStateType { Uninitialized, Sleeping, Kinematic, Static, Dynamic };
class FRigidBodyHandle_Internal {
 public:
  FVec3 X() const;
  FRotation3 R() const;
  FVec3 V() const;
  FVec3 W() const;
  FReal M() const;
  TVec3<FRealSingle> I() const;
  FVec3 CenterOfMass() const;
  FRotation3 RotationOfMass() const;
  EObjectStateType ObjectState() const;
  void AddForce(const FVec3& force, bool invalidate);
  void AddTorque(const FVec3& torque, bool invalidate);
};
class FSingleParticlePhysicsProxy {
 public:
  FRigidBodyHandle_Internal* GetPhysicsThreadAPI();
};
struct FSimCallbackInput {
  virtual ~FSimCallbackInput();
};
struct FSimCallbackOutput {
  FReal InternalTime;
};
enum class ESimCallbackOptions { Presimulate };
template <typename T>
class TSimCallbackOutputHandle {
 public:
  T* operator->() const;
  explicit operator bool() const;
};
class ISimCallbackObject {
 public:
  virtual ~ISimCallbackObject();
  FReal GetDeltaTime_Internal() const;

 private:
  virtual void OnPreSimulate_Internal() = 0;
};
template <typename Input, typename Output, ESimCallbackOptions options>
class TSimCallbackObject : public ISimCallbackObject {
 public:
  Input* GetProducerInputData_External();
  TSimCallbackOutputHandle<Output> PopOutputData_External();

 protected:
  const Input* GetConsumerInput_Internal() const;
  Output& GetProducerOutputData_Internal();
};
class FPhysicsSolverBase {
 public:
  template <typename T>
  T* CreateAndRegisterSimCallbackObject_External();
  void UnregisterAndFreeSimCallbackObject_External(ISimCallbackObject* object);
};
class FPBDRigidsSolver : public FPhysicsSolverBase {};
}  // namespace Chaos

using FPhysicsActorHandle = Chaos::FSingleParticlePhysicsProxy*;
class FPhysScene {
 public:
  Chaos::FPBDRigidsSolver* GetSolver() const;
};
struct FBodyInstance {
  FPhysicsActorHandle& GetPhysicsActorHandle();
};

enum ECollisionChannel : int { ECC_WorldStatic, ECC_Visibility };
class AActor;
struct FCollisionQueryParams {
  void AddIgnoredActor(const AActor* actor);
};
struct FHitResult {
  FVector ImpactPoint;
};

class UWorld : public UObject {
 public:
  bool LineTraceSingleByChannel(FHitResult& hit, const FVector& start, const FVector& end, ECollisionChannel channel,
                                const FCollisionQueryParams& params) const;
  FPhysScene* GetPhysicsScene() const;
  float GetGravityZ() const;
};
class USceneComponent : public UObject {
 public:
  FVector GetComponentLocation() const;
};
enum class EComponentPhysicsStateChange : uint8 { Created, Destroyed };
class UPrimitiveComponent;
struct FComponentPhysicsStateChanged {
  // macros of the engine, which look for the name of the function
  template <typename T>
  void AddDynamic(T* object, void (T::*function)(UPrimitiveComponent*, EComponentPhysicsStateChange));
  template <typename T>
  void RemoveDynamic(T* object, void (T::*function)(UPrimitiveComponent*, EComponentPhysicsStateChange));
};
class UPrimitiveComponent : public USceneComponent {
 public:
  FComponentPhysicsStateChanged OnComponentPhysicsStateChanged;
  FBodyInstance* GetBodyInstance(FName bone = FName(), bool get_welded = true, int32 index = -1) const;
};
class AActor : public UObject {
 public:
  USceneComponent* GetRootComponent() const;
};
enum ETickingGroup { TG_PrePhysics };
enum ELevelTick { LEVELTICK_All };
struct FActorComponentTickFunction {
  bool bCanEverTick;
  ETickingGroup TickGroup;
};
namespace EEndPlayReason {
enum Type { Destroyed };
}
class UActorComponent : public UObject {
 public:
  // what the header tool writes into the derived class
  using Super = UActorComponent;
  FActorComponentTickFunction PrimaryComponentTick;
  AActor* GetOwner() const;
  UWorld* GetWorld() const;
  virtual void BeginPlay();
  virtual void EndPlay(const EEndPlayReason::Type reason);
  virtual void TickComponent(float time, ELevelTick type, FActorComponentTickFunction* function);
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
  TSharedPtr<IPlugin> FindPlugin(const TCHAR* name);
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
