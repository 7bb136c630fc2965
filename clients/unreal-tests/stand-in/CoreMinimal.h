// The few types of Unreal that the plugin names, so that a compiler without Unreal checks their use. Nothing is run with them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <initializer_list>
#include <memory>
#include <string>
#include <utility>
#include <vector>

using int32 = std::int32_t;
using uint32 = std::uint32_t;
using uint8 = std::uint8_t;
using uint64 = std::uint64_t;
using SIZE_T = std::size_t;
using TCHAR = char;

#define TEXT(text) text
#define TCHAR_TO_UTF8(text) (text)
#define UTF8_TO_TCHAR(text) (text)
#define UENUM(...)
#define UMETA(...)
#define USTRUCT(...)
#define UCLASS(...)
#define UPROPERTY(...)
#define UFUNCTION(...)
#define GENERATED_BODY()
#define PAPILLA_API
#define PAPILLAHANDS_API
#define UE_LOG(log, level, format, ...) Logged(format __VA_OPT__(, ) __VA_ARGS__)
template <class... T>
void Logged(const char*, T...) {}

struct FString {
  std::string Text;
  FString() = default;
  FString(const char* Of) : Text(Of) {}
  const char* operator*() const { return Text.c_str(); }
  friend FString operator+(const FString& A, const FString& B) { return FString((A.Text + B.Text).c_str()); }
};
struct FName {
  FName(const char*) {}
};

template <class T>
struct TArray {
  std::vector<T> Items;
  TArray() = default;
  TArray(std::initializer_list<T> Of) : Items(Of) {}
  int32 Num() const { return static_cast<int32>(Items.size()); }
  bool IsEmpty() const { return Items.empty(); }
  bool IsValidIndex(int32 At) const { return At >= 0 && At < Num(); }
  void Add(const T& Of) { Items.push_back(Of); }
  void Reset() { Items.clear(); }
  void SetNum(int32 Count) { Items.resize(Count); }
  void SetNumZeroed(int32 Count) { Items.resize(Count); }
  void SetNumUninitialized(int32 Count) { Items.resize(Count); }
  void Init(const T& Of, int32 Count) { Items.assign(Count, Of); }
  T* GetData() { return Items.data(); }
  const T* GetData() const { return Items.data(); }
  T& operator[](int32 At) { return Items[At]; }
  const T& operator[](int32 At) const { return Items[At]; }
  auto begin() { return Items.begin(); }
  auto end() { return Items.end(); }
  auto begin() const { return Items.begin(); }
  auto end() const { return Items.end(); }
};
template <class K, class V>
struct TPair {
  K Key;
  V Value;
};
template <class K, class V>
struct TMap : TArray<TPair<K, V>> {
  void Add(const K& Key, const V& Value) { this->Items.push_back({Key, Value}); }
};

struct FVector {
  double X = 0, Y = 0, Z = 0;
  FVector() = default;
  FVector(double X, double Y, double Z) : X(X), Y(Y), Z(Z) {}
  double operator[](int32 At) const { return At == 0 ? X : At == 1 ? Y : Z; }
  double Size() const { return std::sqrt(X * X + Y * Y + Z * Z); }
  FVector operator-() const { return {-X, -Y, -Z}; }
  FVector operator+(const FVector& B) const { return {X + B.X, Y + B.Y, Z + B.Z}; }
  FVector operator-(const FVector& B) const { return {X - B.X, Y - B.Y, Z - B.Z}; }
  FVector operator*(double By) const { return {By * X, By * Y, By * Z}; }
  struct FRotator Rotation() const;
  static const FVector ZeroVector;
  static const FVector OneVector;
};
inline const FVector FVector::ZeroVector;
inline const FVector FVector::OneVector(1, 1, 1);
struct FVector2D {
  double X = 0, Y = 0;
  FVector2D() = default;
  FVector2D(double X, double Y) : X(X), Y(Y) {}
  static const FVector2D ZeroVector;
};
inline const FVector2D FVector2D::ZeroVector;
struct FIntPoint {
  int32 X = 0, Y = 0;
  FIntPoint() = default;
  FIntPoint(int32 X, int32 Y) : X(X), Y(Y) {}
};
struct FIntVector {
  int32 X = 0, Y = 0, Z = 0;
};
struct FQuat {
  double X = 0, Y = 0, Z = 0, W = 1;
  FQuat() = default;
  FQuat(double X, double Y, double Z, double W) : X(X), Y(Y), Z(Z), W(W) {}
};
struct FRotator {
  FRotator() = default;
  FRotator(double, double, double) {}
  FQuat Quaternion() const { return {}; }
  static const FRotator ZeroRotator;
};
inline const FRotator FRotator::ZeroRotator;
inline FRotator FVector::Rotation() const { return {}; }
struct FTransform {
  FQuat Turn;
  FVector At;
  FTransform() = default;
  explicit FTransform(const FVector& At) : At(At) {}
  FTransform(const FQuat& Turn, const FVector& At) : Turn(Turn), At(At) {}
  FTransform(const FRotator&, const FVector& At) : At(At) {}
  FVector GetLocation() const { return At; }
  FQuat GetRotation() const { return Turn; }
};
struct FLinearColor {
  FLinearColor() = default;
  float R = 0, G = 0, B = 0;
  FLinearColor(float R, float G, float B) : R(R), G(G), B(B) {}
};

template <class T>
struct TSharedPtr : std::shared_ptr<T> {
  using std::shared_ptr<T>::shared_ptr;
  T* Get() const { return this->get(); }
  void Reset() { this->reset(); }
};
template <class T>
struct TUniquePtr : std::unique_ptr<T> {
  using std::unique_ptr<T>::unique_ptr;
  TUniquePtr(std::unique_ptr<T>&& Of) : std::unique_ptr<T>(std::move(Of)) {}
};
template <class T, class... A>
TUniquePtr<T> MakeUnique(A&&... Of) { return std::make_unique<T>(std::forward<A>(Of)...); }
template <class T>
struct TWeakObjectPtr {
  T* Of;
  explicit TWeakObjectPtr(T* Of) : Of(Of) {}
  T* Get() const { return Of; }
};
template <class T>
struct TObjectPtr {
  T* Of = nullptr;
  TObjectPtr() = default;
  TObjectPtr(T* Of) : Of(Of) {}
  operator T*() const { return Of; }
  T* operator->() const { return Of; }
};
template <class T>
void Swap(T& A, T& B) { std::swap(A, B); }

namespace FMath {
template <class T>
T Max(T A, T B) { return std::max(A, B); }
template <class T>
T Clamp(T A, T B, T C) { return std::clamp(A, B, C); }
inline double Cos(double Of) { return std::cos(Of); }
inline double Sin(double Of) { return std::sin(Of); }
}  // namespace FMath
namespace FMemory {
inline void Memcpy(void* To, const void* From, std::size_t Count) { std::memcpy(To, From, Count); }
}  // namespace FMemory
struct FPlatformTime {
  static double Seconds() { return 0; }
};

template <class... A>
struct TEvent {
  template <class F>
  void AddLambda(F Call) { std::function<void(A...)> Checked = Call; }
  template <class F>
  void BindLambda(F Call) { std::function<void(A...)> Checked = Call; }
  template <class T, class F>
  void AddDynamic(T* Of, F Call) { (void)sizeof(std::function<void(A...)>([=](A... Each) { (Of->*Call)(Each...); })); }
  void Broadcast(A...) {}
  void Clear() {}
};
#define DECLARE_DYNAMIC_MULTICAST_DELEGATE(Name) using Name = TEvent<>
#define DECLARE_DYNAMIC_MULTICAST_DELEGATE_TwoParams(Name, A, a, B, b) using Name = TEvent<A, B>

struct UObject {};
struct UClass {};
namespace EEndPlayReason {
enum Type { Quit };
}
enum ELevelTick { LEVELTICK_All };
struct FActorComponentTickFunction {};
struct FTick {
  bool bCanEverTick = false;
};
