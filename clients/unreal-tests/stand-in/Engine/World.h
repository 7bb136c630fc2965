#pragma once
#include "GameFramework/PlayerController.h"
struct UWorld : UObject {
  APlayerController* GetFirstPlayerController() const { return nullptr; }
  template <class T>
  T* SpawnActor() { return nullptr; }
};
