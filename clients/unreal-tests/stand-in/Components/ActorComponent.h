#pragma once
#include "CoreMinimal.h"
struct UActorComponent : UObject {
  using Super = UActorComponent;
  FTick PrimaryComponentTick;
  virtual ~UActorComponent() = default;
  virtual void BeginPlay() {}
  virtual void EndPlay(const EEndPlayReason::Type) {}
  virtual void TickComponent(float, ELevelTick, FActorComponentTickFunction*) {}
};
