// Numbers as JSON writes them, whatever locale the program has set: strtod and printf read and write
// a comma where a program of a German desktop has called setlocale.
#pragma once

#include <charconv>
#include <string>
#include <string_view>

// Standard libraries without from_chars for floats (LLVM's before 20) take streams of the classic locale.
#if !defined(__cpp_lib_to_chars) && !defined(PAPILLA_STREAM_NUMBERS)
#define PAPILLA_STREAM_NUMBERS
#endif

#ifdef PAPILLA_STREAM_NUMBERS
#include <locale>
#include <sstream>
#endif

namespace papilla::number {

/// Reads a whole text as a number; false if it is none, or larger than any double.
inline bool read(std::string_view text, double& value) {
  if (text.empty() || text.size() > 63 || text.front() == '+') return false;
  if (text.find_first_not_of("+-.eE0123456789") != text.npos) return false;  // inf, nan
#ifdef PAPILLA_STREAM_NUMBERS
  std::istringstream in{std::string(text)};
  in.imbue(std::locale::classic());
  in >> std::noskipws >> value;
  return !in.fail() && in.peek() == std::istringstream::traits_type::eof();
#else
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (stop != end) return false;
  if (error != std::errc::result_out_of_range) return error == std::errc();
  // Too small to be told from 0, or too large to be told at all.
  value = 0.0;
  return text.find("e-") != text.npos || text.find("E-") != text.npos;
#endif
}

/// The shortest text that reads as the number again, or 17 digits of it; `null` where it is no number.
/// Whole numbers have neither point nor exponent: a reader of whole numbers takes no 1e+06.
inline std::string print(double value) {
  if (!(value - value == 0.0)) return "null";
  constexpr double kWholeMax = 9007199254740992.0;  // 2^53
  if (value >= -kWholeMax && value <= kWholeMax && value == static_cast<double>(static_cast<long long>(value))) {
    return std::to_string(static_cast<long long>(value));
  }
#ifdef PAPILLA_STREAM_NUMBERS
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(17);
  out << value;
  return out.str();
#else
  char digits[32];
  return {digits, std::to_chars(digits, digits + sizeof digits, value).ptr};
#endif
}

}  // namespace papilla::number
