using System.IO;
using UnrealBuildTool;

// The client library of clients/cpp, as clients/unreal/install lays it here: include/wade_client.h and lib/<platform>/.
public class WadeClient : ModuleRules
{
	public WadeClient(ReadOnlyTargetRules Target) : base(Target)
	{
		Type = ModuleType.External;

		string Platform = Target.Platform.ToString();
		string Libraries = Path.Combine(ModuleDirectory, "lib", Platform);
		PublicSystemIncludePaths.Add(Required(Path.Combine(ModuleDirectory, "include"), "wade_client.h"));

		if (Target.Platform == UnrealTargetPlatform.Win64)
		{
			Required(Libraries, "wade_client.dll");
			Required(Libraries, "wade_client.dll.lib");
			PublicAdditionalLibraries.Add(Path.Combine(Libraries, "wade_client.dll.lib"));
			PublicDelayLoadDLLs.Add("wade_client.dll");
			RuntimeDependencies.Add(Path.Combine(Libraries, "wade_client.dll"));
		}
		else
		{
			string Name = Target.Platform == UnrealTargetPlatform.Mac ? "libwade_client.dylib" : "libwade_client.so";
			Required(Libraries, Name);
			string Library = Path.Combine(Libraries, Name);
			PublicAdditionalLibraries.Add(Library);
			PublicDelayLoadDLLs.Add(Library);
			RuntimeDependencies.Add(Library);
			if (Target.Platform != UnrealTargetPlatform.Mac)
			{
				// the name that the library has in itself, under which the loader looks for it
				RuntimeDependencies.Add(Path.Combine(Required(Libraries, Name + ".2"), Name + ".2"));
			}
		}
	}

	private static string Required(string Folder, string Name)
	{
		if (!File.Exists(Path.Combine(Folder, Name)))
		{
			throw new BuildException("Wade: {0} is missing. Run clients/unreal/install (see clients/unreal/README.md).",
				Path.Combine(Folder, Name));
		}
		return Folder;
	}
}
