#pragma once
#include "GameFramework/Actor.h"
struct AGameModeBase : AActor {
  using Super = AGameModeBase;
  virtual void StartPlay() {}
};
