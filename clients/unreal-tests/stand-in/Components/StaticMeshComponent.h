#pragma once
#include "GameFramework/Actor.h"
struct UStaticMesh;
struct UStaticMeshComponent : USceneComponent {
  bool SetStaticMesh(UStaticMesh*) { return true; }
};
