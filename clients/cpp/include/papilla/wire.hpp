// Frames of the protocol (docs/reference/protocol.md): headers and samples. No allocation.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace papilla {

constexpr int side_px = 224;
constexpr std::size_t map_len = std::size_t{side_px} * side_px;
constexpr std::size_t header_bytes = 48;
constexpr std::uint8_t protocol_version = 3;

enum class SampleType : std::uint8_t { f32 = 0, f16 = 1, u16 = 2, u8 = 3 };

/// What became of a frame. The first five are the wire's numbers.
enum class Status : std::uint8_t { ok = 0, superseded = 1, late = 2, error = 3, stale = 4, lost = 5 };

enum class Kind : std::uint8_t { pressure = 1, sed = 2, objects = 4, gaps = 5 };

/// A rectangle of the map, pixels; the default is all of it.
struct Window {
  std::uint16_t column = 0;
  std::uint16_t row = 0;
  std::uint16_t width = side_px;
  std::uint16_t height = side_px;

  std::size_t pixels() const { return std::size_t{width} * height; }
  bool inside() const { return column + width <= side_px && row + height <= side_px; }
};

struct Header {
  Kind kind = Kind::pressure;
  SampleType sample_type = SampleType::f32;
  Status status = Status::ok;
  std::uint32_t sequence = 0;
  Window window;
  std::uint64_t client_time_us = 0;
  std::uint32_t time_us = 0;
  float scale = 1.0F;
  std::uint32_t queue_us = 0;
  std::uint32_t infer_us = 0;
  std::uint16_t tier = 0;
  std::uint8_t flags = 0;               ///< bits of wire::Flag
  std::uint8_t finger = 0;              ///< its number
};

namespace wire {

/// Bits of an answer's flags; `not_tracked` also of a request.
enum Flag : std::uint8_t {
  out_of_range = 1, no_contact = 2, unfamiliar = 4, unsettled = 8, cut_off = 16, not_tracked = 32, coarse_clock = 64
};

/// Before the samples of the section `rates`: their scale, and zeros.
constexpr std::size_t rates_head_bytes = 16;

/// Little-endian, whatever the machine is; compilers make one move of it.
template <class T>
inline void put(std::uint8_t* at, T value) {
  for (std::size_t i = 0; i < sizeof value; ++i) {
    at[i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i));
  }
}

template <class T>
inline T get(const std::uint8_t* at) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) value |= std::uint64_t{at[i]} << (8 * i);
  return static_cast<T>(value);
}

inline void put_float(std::uint8_t* at, float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  put(at, bits);
}

inline float get_float(const std::uint8_t* at) {
  const auto bits = get<std::uint32_t>(at);
  float value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

inline void encode(const Header& header, std::uint8_t* at) {
  std::memset(at, 0, header_bytes);
  std::memcpy(at, "PPL1", 4);
  at[4] = protocol_version;
  at[5] = static_cast<std::uint8_t>(header.kind);
  at[6] = static_cast<std::uint8_t>(header.sample_type);
  put(at + 8, header.sequence);
  put(at + 12, header.window.width);
  put(at + 14, header.window.height);
  put(at + 16, header.client_time_us);
  put(at + 24, header.time_us);
  put_float(at + 28, header.scale);
  put(at + 32, header.window.column);
  put(at + 34, header.window.row);
  at[46] = header.flags;
  at[47] = header.finger;
}

/// Reads an answer's header; false if it is none.
inline bool decode(const std::uint8_t* at, std::size_t size, Header& header) {
  if (size < header_bytes || std::memcmp(at, "PPL1", 4) != 0 || at[4] != protocol_version) return false;
  if (at[5] != 2 || at[6] > 3 || at[7] > 4) return false;
  header.kind = static_cast<Kind>(at[5]);
  header.sample_type = static_cast<SampleType>(at[6]);
  header.status = static_cast<Status>(at[7]);
  header.sequence = get<std::uint32_t>(at + 8);
  header.window = {get<std::uint16_t>(at + 32), get<std::uint16_t>(at + 34),
                   get<std::uint16_t>(at + 12), get<std::uint16_t>(at + 14)};
  header.client_time_us = get<std::uint64_t>(at + 16);
  header.time_us = get<std::uint32_t>(at + 24);
  header.scale = get_float(at + 28);
  header.queue_us = get<std::uint32_t>(at + 36);
  header.infer_us = get<std::uint32_t>(at + 40);
  header.tier = get<std::uint16_t>(at + 44);
  header.flags = at[46];
  header.finger = at[47];
  return true;
}

}  // namespace wire

inline std::size_t sample_bytes(SampleType type) {
  return type == SampleType::f32 ? 4 : type == SampleType::u8 ? 1 : 2;
}

/// The greatest unit of a scaled type; 0 for floats.
inline float unit_max(SampleType type) {
  return type == SampleType::u16 ? 65535.0F : type == SampleType::u8 ? 255.0F : 0.0F;
}

inline const char* name_of(SampleType type) {
  constexpr const char* names[] = {"f32", "f16", "u16", "u8"};
  return names[static_cast<int>(type)];
}

inline bool sample_type_of(std::string_view name, SampleType& type) {
  for (const auto each : {SampleType::f32, SampleType::f16, SampleType::u16, SampleType::u8}) {
    if (name == name_of(each)) return type = each, true;
  }
  return false;
}

/// To half precision, to nearest even; beyond 65504 clamps, NaN stays.
inline std::uint16_t to_half(float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  const auto sign = static_cast<std::uint16_t>((bits >> 16) & 0x8000U);
  bits &= 0x7fffffffU;
  if (bits > 0x7f800000U) return sign | 0x7e00U;
  if (bits >= 0x477ff000U) return sign | 0x7bffU;
  if (bits < 0x38800000U) {
    // Subnormal: adding this number leaves the rounded units in the last bits.
    float positive;
    std::memcpy(&positive, &bits, sizeof positive);
    positive += 0.5F;
    std::memcpy(&bits, &positive, sizeof bits);
    return static_cast<std::uint16_t>(sign | (bits - 0x3f000000U));
  }
  const std::uint32_t odd = (bits >> 13) & 1U;
  return static_cast<std::uint16_t>(sign | ((bits - 0x38000000U + 0xfffU + odd) >> 13));
}

inline float from_half(std::uint16_t half) {
  // The exponent's bias differs by 112; the product makes subnormals right as well.
  const std::uint32_t bits = std::uint32_t{half & 0x7fffU} << 13;
  float value;
  std::memcpy(&value, &bits, sizeof value);
  value *= 5.192296858534828e33F;
  if ((half & 0x7c00U) == 0x7c00U) value = half & 0x3ffU ? std::nanf("") : HUGE_VALF;
  return half & 0x8000U ? -value : value;
}

/// The finest scale that clips none of `count` values; 1 for floats and for zeros.
inline float scale_for(SampleType type, const float* values, std::size_t count) {
  const float units = unit_max(type);
  if (units == 0.0F) return 1.0F;
  float top = 0.0F;
  for (std::size_t i = 0; i < count; ++i) {
    // NaN goes through: the scale becomes NaN and the service refuses the frame.
    top = values[i] <= top ? top : values[i];
    if (std::isnan(top)) break;
  }
  return top == 0.0F ? 1.0F : top / units;
}

inline void encode_samples(SampleType type, const float* values, std::size_t count, float scale,
                           std::uint8_t* at) {
  const auto unit = [&](float value) {
    const float units = value / scale + 0.5F;
    return static_cast<std::uint32_t>(units > 0.0F ? std::min(units, unit_max(type)) : 0.0F);
  };
  switch (type) {
    case SampleType::f32:
      for (std::size_t i = 0; i < count; ++i) wire::put_float(at + 4 * i, values[i]);
      break;
    case SampleType::f16:
      for (std::size_t i = 0; i < count; ++i) wire::put(at + 2 * i, to_half(values[i]));
      break;
    case SampleType::u16:
      for (std::size_t i = 0; i < count; ++i) {
        wire::put(at + 2 * i, static_cast<std::uint16_t>(unit(values[i])));
      }
      break;
    case SampleType::u8:
      for (std::size_t i = 0; i < count; ++i) at[i] = static_cast<std::uint8_t>(unit(values[i]));
      break;
  }
}

inline void decode_samples(SampleType type, const std::uint8_t* at, std::size_t count, float scale,
                           float* values) {
  for (std::size_t i = 0; i < count; ++i) {
    switch (type) {
      case SampleType::f32: values[i] = wire::get_float(at + 4 * i); break;
      case SampleType::f16: values[i] = from_half(wire::get<std::uint16_t>(at + 2 * i)); break;
      case SampleType::u16: values[i] = scale * wire::get<std::uint16_t>(at + 2 * i); break;
      case SampleType::u8: values[i] = scale * at[i]; break;
    }
  }
}

}  // namespace papilla
