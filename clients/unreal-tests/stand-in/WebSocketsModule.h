#pragma once
#include "IWebSocket.h"
struct FWebSocketsModule {
  TSharedPtr<IWebSocket> CreateWebSocket(const FString&, const FString&, const TMap<FString, FString>&) { return {}; }
};
