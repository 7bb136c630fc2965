// Says the types of hello.hpp as JSON.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "json.hpp"

namespace papilla {

enum class SampleType : std::uint8_t;
struct SkinPoint;
struct OtherShape;
struct OtherEffect;

namespace detail {

/// Members of an object, one after the other: `text` is JSON without braces.
class HelloWriter {
 public:
  std::string text;

  template <class T>
  void operator()(const char* name, const T& value) {
    raw(json::quoted(name) + ":" + word(value));
  }
  template <class T>
  void operator()(const char* name, const std::optional<T>& value) {
    if (value) (*this)(name, *value);
  }
  template <class T>
  void unless(const char* name, const T& value, const T& usual) {
    if (!(value == usual)) (*this)(name, value);
  }
  template <class T>
  void unless_empty(const char* name, const T& value) {
    if (!value.empty()) (*this)(name, value);
  }
  /// Instead of members, for an effect whose parameter is a list.
  template <class T>
  void list(const std::vector<T>& values) {
    list_ = word(values);
  }
  void raw(std::string_view members) {
    if (!text.empty()) text += ',';
    text += members;
  }

  /// The names of effects, and the parameters of each in the member of its name.
  template <class Effect>
  void effects(const std::vector<Effect>& all) {
    std::vector<std::string> names;
    for (const Effect& each : all) {
      names.push_back(std::visit([](const auto& of) { return std::string(of.name); }, each));
    }
    (*this)("effects", names);
    for (const Effect& each : all) {
      std::visit([this](const auto& of) { parameters(of); }, each);
    }
  }

 private:
  std::string list_;

  template <class T, class = void>
  struct has_members : std::false_type {};
  template <class T>
  struct has_members<T, std::void_t<decltype(T::visit(std::declval<const T&>(), std::declval<HelloWriter&>()))>> : std::true_type {};

  template <class T>
  void parameters(const T& of) {
    if constexpr (std::is_same_v<T, OtherEffect>) {
      if (!of.json.empty()) raw(json::quoted(of.name) + ":" + of.json);
    } else if constexpr (has_members<T>::value) {
      raw(json::quoted(of.name) + ":" + object(of, {}));
    }
  }

  template <class T>
  static std::string object(const T& of, std::string_view shape) {
    HelloWriter inner;
    if (!shape.empty()) inner("shape", shape);
    if constexpr (std::is_same_v<T, OtherShape>) {
      if (!of.json.empty()) inner.raw(of.json);
    } else {
      T::visit(of, inner);
    }
    return inner.list_.empty() ? "{" + inner.text + "}" : inner.list_;
  }

  static std::string named(std::monostate) { return {}; }
  template <class T>
  static std::string named(const T& of) {
    return object(of, of.name);
  }

  static std::string word(bool value) { return value ? "true" : "false"; }
  static std::string word(double value) { return number::print(value); }
  static std::string word(std::uint32_t value) { return std::to_string(value); }
  static std::string word(std::string_view value) { return json::quoted(value); }
  static std::string word(const std::string& value) { return json::quoted(value); }
  template <class T>
  static std::string word(const std::vector<T>& values) {
    return row(values);
  }
  template <class T, std::size_t N>
  static std::string word(const std::array<T, N>& values) {
    return row(values);
  }
  template <class... T>
  static std::string word(const std::variant<T...>& shape) {
    // Without a shape the service says which object has none.
    if (std::holds_alternative<std::monostate>(shape)) return "null";
    return std::visit([](const auto& of) { return named(of); }, shape);
  }
  template <class T>
  static std::string word(const T& value) {
    if constexpr (std::is_same_v<T, SampleType>) {
      constexpr std::array<const char*, 4> words{"f32", "f16", "u16", "u8"};
      return json::quoted(words.at(static_cast<std::size_t>(value)));
    } else if constexpr (std::is_enum_v<T>) {
      return json::quoted(words_of(value).at(static_cast<std::size_t>(value)));
    } else if constexpr (std::is_same_v<T, SkinPoint>) {
      HelloWriter inner;
      if (value.is_px) inner("px", std::array<double, 2>{value.at[0], value.at[1]});
      else inner("mm", value.at);
      return "{" + inner.text + "}";
    } else {
      return object(value, {});
    }
  }
  template <class List>
  static std::string row(const List& values) {
    std::string out = "[";
    for (const auto& each : values) {
      if (out.size() > 1) out += ',';
      out += word(each);
    }
    return out + "]";
  }
};

}  // namespace detail
}  // namespace papilla
