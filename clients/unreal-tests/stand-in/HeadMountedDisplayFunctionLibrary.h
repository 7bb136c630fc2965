#pragma once
#include "CoreMinimal.h"
#include "InputCoreTypes.h"
enum class EHandKeypoint : uint8 { IndexDistal = 9, IndexTip = 10 };
struct FXRMotionControllerData {
  bool bValid = false;
  TArray<FVector> HandKeyPositions;
  TArray<FQuat> HandKeyRotations;
};
struct UHeadMountedDisplayFunctionLibrary {
  static void GetMotionControllerData(UObject*, const EControllerHand, FXRMotionControllerData&) {}
};
