#pragma once
#include "CoreMinimal.h"
enum class EControllerHand : uint8 { Left, Right };
enum class EHandKeypoint : uint8 { IndexDistal = 9, IndexTip = 10 };
struct FXRMotionControllerData {
  bool bValid = false;
  TArray<FVector> HandKeyPositions;
  TArray<FQuat> HandKeyRotations;
};
struct UHeadMountedDisplayFunctionLibrary {
  static void GetMotionControllerData(UObject*, const EControllerHand, FXRMotionControllerData&) {}
};
