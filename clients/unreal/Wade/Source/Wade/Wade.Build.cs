using UnrealBuildTool;

public class Wade : ModuleRules
{
	public Wade(ReadOnlyTargetRules Target) : base(Target)
	{
		PCHUsage = PCHUsageMode.UseExplicitOrSharedPCHs;

		PublicDependencyModuleNames.AddRange(new string[] { "Core", "CoreUObject", "DeveloperSettings", "Engine" });
		PrivateDependencyModuleNames.AddRange(new string[] { "Chaos", "PhysicsCore", "Projects", "WadeClient" });
		// "core/hydrodynamics.h" and the like, the engine-free part
		PrivateIncludePaths.Add(System.IO.Path.Combine(ModuleDirectory, "Private"));
	}
}
