#pragma once
#include "CoreMinimal.h"
struct IWebSocket {
  TEvent<> Connected;
  TEvent<const FString&> Error, Message;
  TEvent<int32, const FString&, bool> Closed;
  TEvent<const void*, SIZE_T, bool> Binary;
  auto& OnConnected() { return Connected; }
  auto& OnConnectionError() { return Error; }
  auto& OnClosed() { return Closed; }
  auto& OnMessage() { return Message; }
  auto& OnBinaryMessage() { return Binary; }
  void Connect() {}
  void Close() {}
  void Send(const FString&) {}
  void Send(const void*, SIZE_T, bool) {}
};
