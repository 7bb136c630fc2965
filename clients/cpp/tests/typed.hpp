// A case's hello built from the client's types, member by member: one that they lack fails the case.
#pragma once

#include <set>

#include "checks.hpp"

namespace typed {

using namespace papilla;
using json::Value;

/// The number with which a variant has an alternative of that name.
template <class Variant, std::size_t I = 0>
bool choose(const std::string& name, Variant& to) {
  if constexpr (I < std::variant_size_v<Variant>) {
    using T = std::variant_alternative_t<I, Variant>;
    if constexpr (!std::is_same_v<T, std::monostate> && !std::is_same_v<T, OtherShape> && !std::is_same_v<T, OtherEffect>) {
      if (T::name == name) return to.template emplace<I>(), true;
    }
    return choose<Variant, I + 1>(name, to);
  }
  return false;
}

/// Fills what is visited from the members of a JSON object.
class Reader {
 public:
  explicit Reader(const Value& from) : from_(from) {}

  template <class T>
  void operator()(const char* name, T& to) {
    seen_.insert(name);
    if (from_.has(name)) read(from_[name], to);
  }
  template <class T>
  void unless(const char* name, T& to, const T&) { (*this)(name, to); }
  template <class T>
  void unless_empty(const char* name, T& to) { (*this)(name, to); }
  template <class T>
  void list(std::vector<T>& to) { read(from_, to); }

  /// All of them have to be known, but for these.
  void all_seen(std::set<std::string> others) const {
    for (const auto& [name, value] : from_.members) must(seen_.count(name) + others.count(name) != 0, "no type has " + name);
  }

  static void read(const Value& from, double& to) { to = from.number; }
  static void read(const Value& from, std::uint32_t& to) { to = static_cast<std::uint32_t>(from.whole()); }
  static void read(const Value& from, bool& to) { to = from.boolean; }
  static void read(const Value& from, std::string& to) { to = from.string; }
  static void read(const Value& from, SampleType& to) { must(sample_type_of(from.string, to), "no sample type"); }
  static void read(const Value& from, SkinPoint& to) {
    const Value& at = from.has("px") ? from["px"] : from["mm"];
    to = from.has("px") ? SkinPoint::px(at[0].number, at[1].number) : SkinPoint::mm(at[0].number, at[1].number, at[2].number);
  }
  static void read(const Value& from, Shape& to) {
    must(choose(from["shape"].string, to), "no shape " + from["shape"].string);
    std::visit([&](auto& of) { fill(from, of, {"shape"}); }, to);
  }
  template <class T>
  static void read(const Value& from, std::optional<T>& to) { read(from, to.emplace()); }
  template <class T>
  static void read(const Value& from, std::vector<T>& to) {
    for (const Value& each : from.items) read(each, to.emplace_back());
  }
  template <class T, std::size_t N>
  static void read(const Value& from, std::array<T, N>& to) {
    for (std::size_t i = 0; i < N; ++i) read(from[i], to[i]);
  }
  template <class T>
  static void read(const Value& from, T& to) {
    if constexpr (std::is_enum_v<T>) {
      const auto words = words_of(to);
      const auto at = std::find(words.begin(), words.end(), std::string_view(from.string));
      must(at != words.end(), "no word " + from.string);
      to = static_cast<T>(at - words.begin());
    } else {
      fill(from, to, {});
    }
  }

  template <class T>
  static void fill(const Value& from, T& to, const std::set<std::string>& others) {
    if constexpr (!std::is_same_v<T, std::monostate> && !std::is_same_v<T, OtherShape> && !std::is_same_v<T, OtherEffect> &&
                  !std::is_empty_v<T>) {
      Reader in(from);
      T::visit(to, in);
      if (from.type == Value::Type::object) in.all_seen(others);
    }
  }

 private:
  const Value& from_;
  std::set<std::string> seen_;
};

/// All that is due is there; what is left out is a default.
inline void holds(const std::string& where, const Value& due, const Value& found) {
  if (due.type == Value::Type::object) {
    for (const auto& [name, value] : due.members) {
      const bool usual = value.string == "f32" || value.string == "clamp";
      if (found.has(name) || !usual) holds(where + "." + name, value, found[name]);
    }
  } else if (due.type == Value::Type::array) {
    must(due.size() == found.size(), where + " has another length");
    for (std::size_t i = 0; i < due.size(); ++i) holds(where, due[i], found[i]);
  } else {
    must(json::print(due) == json::print(found), where + " is " + json::print(found));
  }
}

inline Hello hello(const Value& from) {
  Hello hello;
  std::set<std::string> names{"effects"};
  for (const Value& name : from["effects"].items) {
    names.insert(name.string);
    Effect effect;
    const Value& parameters = from[name.string];
    // A case without its parameters asks for a refusal.
    if (!choose(name.string, effect) || (name.string == "actuators" && parameters.is_null())) effect = OtherEffect{name.string, {}};
    if (!parameters.is_null()) std::visit([&](auto& of) { Reader::fill(parameters, of, {}); }, effect);
    hello.effects.push_back(effect);
  }
  Reader in(from);
  Hello::visit(hello, in);
  in.all_seen(names);
  Value said;
  must(json::parse("{" + hello.members() + "}", said), "it is no JSON: " + hello.members());
  holds("hello", from, said);
  return hello;
}

}  // namespace typed
