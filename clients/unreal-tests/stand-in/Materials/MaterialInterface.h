#pragma once
#include "CoreMinimal.h"
struct UMaterialInterface : UObject {};
