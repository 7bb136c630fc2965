#pragma once
#include "CoreMinimal.h"
struct FModuleManager {
  template <class T>
  static T& LoadModuleChecked(const FName&) {
    static T Module;
    return Module;
  }
};
struct FDefaultModuleImpl {};
#define IMPLEMENT_MODULE(Type, Name)
