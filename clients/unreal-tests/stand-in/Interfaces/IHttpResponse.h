#pragma once
#include "CoreMinimal.h"
struct IHttpResponse {
  int32 GetResponseCode() const { return 0; }
  FString GetContentAsString() const { return {}; }
};
using FHttpResponsePtr = TSharedPtr<IHttpResponse>;
