// Reads JSON: what the service says in text, and the atlas. No exceptions, bounded depth.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "number.hpp"

namespace papilla::json {

/// A JSON value. Members that are not there read as null, null reads as nothing.
class Value {
 public:
  enum class Type { null, boolean, number, string, array, object };

  Type type = Type::null;
  bool boolean = false;
  double number = 0.0;
  std::string string;
  std::vector<Value> items;                             // array
  std::vector<std::pair<std::string, Value>> members;   // object

  const Value& operator[](std::string_view name) const {
    for (const auto& [key, value] : members) {
      if (key == name) return value;
    }
    return nothing();
  }
  const Value& operator[](std::size_t i) const { return i < items.size() ? items[i] : nothing(); }
  bool has(std::string_view name) const { return (*this)[name].type != Type::null; }
  bool is_null() const { return type == Type::null; }
  std::size_t size() const { return items.size(); }
  /// The number as an integer; 0 if it is none or does not fit.
  std::uint64_t whole() const {
    return number >= 0.0 && number < 18446744073709551615.0 ? static_cast<std::uint64_t>(number) : 0;
  }

 private:
  static const Value& nothing() {
    static const Value value;
    return value;
  }
};

namespace detail {

class Reader {
 public:
  explicit Reader(std::string_view text) : begin_(text.data()), at_(text.data()), end_(text.data() + text.size()) {}

  bool document(Value& value) {
    if (!read(value, 0)) return false;
    blank();
    return at_ == end_;
  }
  /// Bytes that were read: where it is no JSON.
  std::size_t read_bytes() const { return static_cast<std::size_t>(at_ - begin_); }

 private:
  static constexpr int depth_max = 32;
  const char* begin_;
  const char* at_;
  const char* end_;

  void blank() {
    while (at_ != end_ && (*at_ == ' ' || *at_ == '\n' || *at_ == '\r' || *at_ == '\t')) ++at_;
  }
  bool take(char c) {
    blank();
    if (at_ == end_ || *at_ != c) return false;
    ++at_;
    return true;
  }
  bool word(std::string_view expected) {
    if (static_cast<std::size_t>(end_ - at_) < expected.size()) return false;
    if (std::string_view(at_, expected.size()) != expected) return false;
    at_ += expected.size();
    return true;
  }

  bool read(Value& value, int depth) {
    blank();
    if (at_ == end_ || depth > depth_max) return false;
    switch (*at_) {
      case '{': return object(value, depth);
      case '[': return array(value, depth);
      case '"': value.type = Value::Type::string; return text(value.string);
      case 't': value.type = Value::Type::boolean; value.boolean = true; return word("true");
      case 'f': value.type = Value::Type::boolean; return word("false");
      case 'n': return word("null");
      default: return number(value);
    }
  }

  bool object(Value& value, int depth) {
    value.type = Value::Type::object;
    ++at_;
    if (take('}')) return true;
    do {
      blank();
      auto& [name, member] = value.members.emplace_back();
      if (at_ == end_ || *at_ != '"' || !text(name) || !take(':') || !read(member, depth + 1)) {
        return false;
      }
    } while (take(','));
    return take('}');
  }

  bool array(Value& value, int depth) {
    value.type = Value::Type::array;
    ++at_;
    if (take(']')) return true;
    do {
      if (!read(value.items.emplace_back(), depth + 1)) return false;
    } while (take(','));
    return take(']');
  }

  bool number(Value& value) {
    const char* const begin = at_;
    while (at_ != end_ && *at_ && std::strchr("+-.eE0123456789", *at_)) ++at_;
    value.type = Value::Type::number;
    return number::read({begin, static_cast<std::size_t>(at_ - begin)}, value.number);
  }

  bool text(std::string& out) {
    ++at_;
    while (at_ != end_ && *at_ != '"') {
      if (*at_ != '\\') {
        out.push_back(*at_++);
        continue;
      }
      if (++at_ == end_) return false;
      const char c = *at_++;
      if (c == 'u') {
        if (!code_point(out)) return false;
        continue;
      }
      const char* const from = "\"\\/bfnrt";
      const char* const found = std::strchr(from, c);
      if (!found || !c) return false;
      out.push_back("\"\\/\b\f\n\r\t"[found - from]);
    }
    return at_ != end_ && *at_++ == '"';
  }

  bool hex(unsigned& unit) {
    unit = 0;
    for (int i = 0; i < 4; ++i, ++at_) {
      if (at_ == end_) return false;
      const char c = *at_;
      const unsigned digit = c >= '0' && c <= '9'   ? unsigned(c - '0')
                             : c >= 'a' && c <= 'f' ? unsigned(c - 'a' + 10)
                             : c >= 'A' && c <= 'F' ? unsigned(c - 'A' + 10)
                                                    : 16U;
      if (digit > 15) return false;
      unit = unit * 16 + digit;
    }
    return true;
  }

  bool code_point(std::string& out) {
    unsigned c = 0;
    if (!hex(c)) return false;
    if (c >= 0xd800 && c < 0xdc00) {
      unsigned low = 0;
      if (!word("\\u") || !hex(low) || low < 0xdc00 || low > 0xdfff) return false;
      c = 0x10000 + ((c - 0xd800) << 10) + (low - 0xdc00);
    }
    const auto put = [&out](unsigned byte) { out.push_back(static_cast<char>(byte)); };
    if (c < 0x80) return put(c), true;
    if (c < 0x800) return put(0xc0 | (c >> 6)), put(0x80 | (c & 63)), true;
    if (c < 0x10000) put(0xe0 | (c >> 12));
    else put(0xf0 | (c >> 18)), put(0x80 | ((c >> 12) & 63));
    put(0x80 | ((c >> 6) & 63)), put(0x80 | (c & 63));
    return true;
  }
};

}  // namespace detail

/// Reads a whole text; false if it is not JSON, from byte `stop` on.
inline bool parse(std::string_view text, Value& value, std::size_t* stop = nullptr) {
  value = Value();
  detail::Reader reader(text);
  const bool good = reader.document(value);
  if (stop) *stop = reader.read_bytes();
  return good;
}

/// A string with its quotes.
inline std::string quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out.push_back('\\');
    if (static_cast<unsigned char>(c) >= 0x20) out.push_back(c);
  }
  return out += '"';
}

/// The text of a value.
inline std::string print(const Value& value) {
  std::string out;
  switch (value.type) {
    case Value::Type::null: return "null";
    case Value::Type::boolean: return value.boolean ? "true" : "false";
    case Value::Type::string: return quoted(value.string);
    case Value::Type::number: return number::print(value.number);
    case Value::Type::array:
      for (const auto& item : value.items) out += (out.empty() ? "" : ",") + print(item);
      return "[" + out + "]";
    case Value::Type::object:
      for (const auto& [name, member] : value.members) {
        out += (out.empty() ? "" : ",") + quoted(name) + ":" + print(member);
      }
      return "{" + out + "}";
  }
  return out;
}

}  // namespace papilla::json
