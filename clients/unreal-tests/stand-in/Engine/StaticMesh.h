#pragma once
#include "CoreMinimal.h"
struct UStaticMesh : UObject {};
