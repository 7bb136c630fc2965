#pragma once
#include "GameFramework/Actor.h"
struct FKey {};
struct EKeys {
  static const FKey LeftMouseButton;
};
struct APlayerController : AActor {
  void SetViewTarget(AActor*) {}
  bool IsInputKeyDown(FKey) const { return false; }
  bool GetMousePosition(float&, float&) const { return false; }
  void GetViewportSize(int32&, int32&) const {}
};
