#pragma once
#include "GameFramework/Actor.h"
struct UCameraComponent : USceneComponent {};
