using UnrealBuildTool;

public class PapillaHands : ModuleRules
{
    public PapillaHands(ReadOnlyTargetRules Target) : base(Target)
    {
        PCHUsage = PCHUsageMode.UseExplicitOrSharedPCHs;
        CppStandard = CppStandardVersion.Cpp20;
        // Of the C++ client's headers, which the component's header includes.
        bEnableExceptions = true;
        PublicDependencyModuleNames.AddRange(new[] { "Core", "CoreUObject", "Engine", "Papilla", "ProceduralMeshComponent" });
        PrivateDependencyModuleNames.AddRange(new[] { "HeadMountedDisplay", "InputCore" });
    }
}
