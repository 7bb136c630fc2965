#pragma once
#include "GameFramework/Actor.h"
struct UMaterialInterface;
struct FProcMeshTangent {};
struct UProceduralMeshComponent : USceneComponent {
  void SetMaterial(int32, UMaterialInterface*) {}
  void CreateMeshSection_LinearColor(int32, const TArray<FVector>&, const TArray<int32>&, const TArray<FVector>&, const TArray<FVector2D>&,
                                     const TArray<FLinearColor>&, const TArray<FProcMeshTangent>&, bool) {}
  void UpdateMeshSection_LinearColor(int32, const TArray<FVector>&, const TArray<FVector>&, const TArray<FVector2D>&, const TArray<FLinearColor>&,
                                     const TArray<FProcMeshTangent>&) {}
};
