#pragma once
#include "IHttpResponse.h"
struct IHttpRequest;
using FHttpRequestPtr = TSharedPtr<IHttpRequest>;
struct IHttpRequest {
  TEvent<FHttpRequestPtr, FHttpResponsePtr, bool> Complete;
  auto& OnProcessRequestComplete() { return Complete; }
  void SetTimeout(float) {}
  void SetURL(const FString&) {}
  void SetHeader(const FString&, const FString&) {}
  void ProcessRequest() {}
};
