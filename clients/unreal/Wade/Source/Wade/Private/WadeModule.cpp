#include "WadeModule.h"

#include "HAL/PlatformProcess.h"
#include "Interfaces/IPluginManager.h"
#include "Misc/Paths.h"
#include "Modules/ModuleManager.h"
#include "wade_client.h"

DEFINE_LOG_CATEGORY(LogWade);

IMPLEMENT_MODULE(FWadeModule, Wade)

namespace
{
#if PLATFORM_WINDOWS
	const TCHAR* const LibraryName = TEXT("Win64/wade_client.dll");
#elif PLATFORM_MAC
	const TCHAR* const LibraryName = TEXT("Mac/libwade_client.dylib");
#elif PLATFORM_CPU_ARM_FAMILY
	const TCHAR* const LibraryName = TEXT("LinuxArm64/libwade_client.so");
#else
	const TCHAR* const LibraryName = TEXT("Linux/libwade_client.so");
#endif
}

void FWadeModule::StartupModule()
{
	const TSharedPtr<IPlugin> Plugin = IPluginManager::Get().FindPlugin(TEXT("Wade"));
	const FString Path = FPaths::Combine(Plugin->GetBaseDir(), TEXT("Source/ThirdParty/WadeClient/lib"), LibraryName);
	Library = FPlatformProcess::GetDllHandle(*Path);
	if (Library == nullptr)
	{
		UE_LOG(LogWade, Error, TEXT("%s cannot be loaded, so that no water acts. Run clients/unreal/install of wade, then build again."), *Path);
		return;
	}
	const uint32 Version = wade_abi_version();
	if (Version != WADE_ABI_VERSION)
	{
		UE_LOG(LogWade, Error, TEXT("%s has version %u, the plugin was compiled for %d, so that no water acts. Run clients/unreal/install of wade, then build again."), *Path, Version, WADE_ABI_VERSION);
		FPlatformProcess::FreeDllHandle(Library);
		Library = nullptr;
	}
}

bool FWadeModule::IsLibraryLoaded()
{
	return FModuleManager::GetModuleChecked<FWadeModule>(TEXT("Wade")).Library != nullptr;
}
