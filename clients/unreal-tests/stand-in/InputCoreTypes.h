#pragma once
#include "CoreMinimal.h"
enum class EControllerHand : uint8 { Left, Right };
struct FKey {};
struct EKeys {
  static const FKey LeftMouseButton;
};
