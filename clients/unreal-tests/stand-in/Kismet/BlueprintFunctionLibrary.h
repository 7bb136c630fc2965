#pragma once
#include "CoreMinimal.h"
struct UBlueprintFunctionLibrary : UObject {};
