#pragma once
#include "GameFramework/Actor.h"
#include "InputCoreTypes.h"
struct APlayerController : AActor {
  void SetViewTarget(AActor*) {}
  bool IsInputKeyDown(FKey) const { return false; }
  bool GetMousePosition(float&, float&) const { return false; }
  void GetViewportSize(int32&, int32&) const {}
  void SetHapticsByValue(const float, const float, EControllerHand) {}
};
