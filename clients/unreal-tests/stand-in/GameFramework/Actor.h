#pragma once
#include "CoreMinimal.h"
struct UWorld;
struct USceneComponent : UObject {
  void SetupAttachment(USceneComponent*) {}
  void SetWorldTransform(const FTransform&) {}
  void SetWorldScale3D(const FVector&) {}
  void SetVisibility(bool) {}
  void SetHiddenInGame(bool) {}
};
struct AActor : UObject {
  using Super = AActor;
  FTick PrimaryActorTick;
  TObjectPtr<USceneComponent> RootComponent;
  virtual ~AActor() = default;
  virtual void BeginPlay() {}
  virtual void Tick(float) {}
  FVector GetActorLocation() const { return {}; }
  UWorld* GetWorld() const { return nullptr; }
  template <class T>
  T* FindComponentByClass() const { return nullptr; }
  template <class T>
  T* CreateDefaultSubobject(FName) { return new T; }
};
