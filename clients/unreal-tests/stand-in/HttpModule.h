#pragma once
#include "Interfaces/IHttpRequest.h"
struct FHttpModule {
  static FHttpModule& Get();
  FHttpRequestPtr CreateRequest();
};
