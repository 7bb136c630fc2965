#pragma once
#include "GameFramework/Actor.h"
struct UArrowComponent : USceneComponent {};
