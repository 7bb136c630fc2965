#pragma once
#include "CoreMinimal.h"
struct AActor;
struct UActorComponent : UObject {
  using Super = UActorComponent;
  FTick PrimaryComponentTick;
  virtual ~UActorComponent() = default;
  AActor* GetOwner() const { return nullptr; }
  virtual void BeginPlay() {}
  virtual void EndPlay(const EEndPlayReason::Type) {}
  virtual void TickComponent(float, ELevelTick, FActorComponentTickFunction*) {}
};
