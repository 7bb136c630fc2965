using System.IO;
using UnrealBuildTool;

public class Papilla : ModuleRules
{
    public Papilla(ReadOnlyTargetRules Target) : base(Target)
    {
        PCHUsage = PCHUsageMode.UseExplicitOrSharedPCHs;
        CppStandard = CppStandardVersion.Cpp20;
        // papilla/answer.hpp throws where an answer is asked for what it does not carry, papilla/device.hpp where there is no such device.
        bEnableExceptions = true;
        PublicDependencyModuleNames.AddRange(new[] { "Core", "CoreUObject", "Engine" });
        PrivateDependencyModuleNames.AddRange(new[] { "HTTP", "WebSockets" });
        // The C++ client's headers: copied into the plugin, or beside it as in the repository.
        string Copied = Path.Combine(PluginDirectory, "Source", "ThirdParty", "include");
        string Beside = Path.Combine(PluginDirectory, "..", "..", "cpp", "include");
        PublicIncludePaths.Add(Directory.Exists(Copied) ? Copied : Path.GetFullPath(Beside));
    }
}
