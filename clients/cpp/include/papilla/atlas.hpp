// The atlas: which point of the finger each pixel is, and pressure maps from what engines have.
// Formulas: docs/reference/atlas.md, 'Helpers of the clients'.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "json.hpp"
#include "wire.hpp"

namespace papilla {

/// A contact point: a place on or near the undeformed skin (finger's frame), a force, a radius.
struct Contact {
  std::array<double, 3> at_mm{};
  double force_n = 0.0;
  double radius_mm = 0.0;  ///< 0: the finger's own on a flat object
};

class Atlas {
 public:
  /// A pixel of the skin: where it is and how much of the finger it shows.
  struct Pixel {
    std::uint32_t index = 0;               ///< row * 224 + column
    std::array<std::uint32_t, 3> corners{};
    std::array<double, 3> weights{};
    std::array<double, 3> place_mm{};
    double area_mm2 = 0.0;
  };

  std::string hash;
  std::vector<std::array<double, 3>> positions_mm;  ///< of the skin's vertices
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Pixel> pixels;                        ///< of the skin, ascending

  /// Reads what `GET /v1/atlas` answers; false if it is no atlas. Some milliseconds.
  bool parse(std::string_view text) {
    json::Value file;
    if (!json::parse(text, file)) return false;
    hash = file["hash"].string;
    // As float first: the file's decimal numbers are those of f32 values.
    const auto number = [](const json::Value& value) { return double(static_cast<float>(value.number)); };
    const json::Value& skin = file["skin"];
    std::vector<std::array<double, 2>> uv_px;
    for (const auto& p : skin["positions_mm"].items) {
      positions_mm.push_back({number(p[0]), number(p[1]), number(p[2])});
    }
    for (const auto& uv : skin["uv_px"].items) uv_px.push_back({number(uv[0]), number(uv[1])});
    for (const auto& t : file["triangles"].items) {
      const auto corner = [&](std::size_t i) { return static_cast<std::uint32_t>(t[i].whole()); };
      triangles.push_back({corner(0), corner(1), corner(2)});
      for (const auto v : triangles.back()) {
        if (v >= positions_mm.size() || v >= uv_px.size()) return false;
      }
    }
    if (positions_mm.empty() || triangles.empty() || hash.empty()) return false;
    cover(uv_px);
    return true;
  }

  /// Draws a field given at the vertices of the skin: linear in each triangle, 0 outside.
  /// `map` has 224 x 224 values. Allocates nothing.
  void rasterise(const float* vertex_values, float* map) const {
    std::fill(map, map + map_len, 0.0F);
    for (const Pixel& pixel : pixels) {
      double value = 0.0;
      for (int i = 0; i < 3; ++i) value += pixel.weights[i] * vertex_values[pixel.corners[i]];
      map[pixel.index] = static_cast<float>(value);
    }
  }

  /// Pressure (Pa) of contact points, each with the pressure of Hertz's contact. A contact more
  /// than 5 mm from the skin adds nothing. Allocates nothing.
  void contacts(const Contact* contacts, std::size_t count, float* map_pa) const {
    std::fill(map_pa, map_pa + map_len, 0.0F);
    for (std::size_t n = 0; n < count; ++n) {
      const Contact& contact = contacts[n];
      const Pixel* own = nullptr;
      double nearest = reach_mm * reach_mm;
      for (const Pixel& pixel : pixels) {
        const double squared = apart(pixel.place_mm, contact.at_mm);
        if (squared < nearest || (!own && squared <= nearest)) nearest = squared, own = &pixel;
      }
      if (!own) continue;
      const double radius_mm =
          contact.radius_mm > 0.0 ? contact.radius_mm : radius_at_1_n_mm * std::cbrt(contact.force_n);
      const double reach = radius_mm * radius_mm;
      const auto weight = [&](const Pixel& pixel) {
        if (&pixel == own) return 1.0;
        const double share = 1.0 - apart(pixel.place_mm, own->place_mm) / reach;
        return share > 0.0 && std::isfinite(share) ? std::sqrt(share) : 0.0;
      };
      double sum = 0.0;
      for (const Pixel& pixel : pixels) sum += weight(pixel) * pixel.area_mm2;
      for (const Pixel& pixel : pixels) {
        map_pa[pixel.index] += static_cast<float>(1e6 * contact.force_n * weight(pixel) / sum);
      }
    }
  }

  /// `1e-6 sum p A` of a pressure map: what a summary calls force.
  double force_n(const float* map_pa) const {
    double sum = 0.0;
    for (const Pixel& pixel : pixels) sum += double(map_pa[pixel.index]) * pixel.area_mm2;
    return 1e-6 * sum;
  }

 private:
  static constexpr double reach_mm = 5.0;
  static constexpr double radius_at_1_n_mm = 5.1;

  static double apart(const std::array<double, 3>& a, const std::array<double, 3>& b) {
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
  }

  double doubled_mm2(const std::array<std::uint32_t, 3>& t) const {
    const auto& a = positions_mm[t[0]];
    const auto& b = positions_mm[t[1]];
    const auto& c = positions_mm[t[2]];
    double p[3], q[3];
    for (int i = 0; i < 3; ++i) p[i] = b[i] - a[i], q[i] = c[i] - a[i];
    const double x = p[1] * q[2] - p[2] * q[1], y = p[2] * q[0] - p[0] * q[2],
                 z = p[0] * q[1] - p[1] * q[0];
    return std::sqrt(x * x + y * y + z * z);
  }

  /// Finds the triangle of every pixel: of those that hold its centre, the first.
  void cover(const std::vector<std::array<double, 2>>& uv_px) {
    // Exact in double: uv_px are multiples of 1/4096.
    const auto doubled = [](const std::array<double, 2>& a, const std::array<double, 2>& b,
                            const std::array<double, 2>& c) {
      return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    };
    std::vector<Pixel> found(map_len);
    std::vector<bool> taken(map_len, false);
    for (const auto& t : triangles) {
      const auto &a = uv_px[t[0]], &b = uv_px[t[1]], &c = uv_px[t[2]];
      const double total = doubled(a, b, c);
      const double area_mm2 = doubled_mm2(t) / std::abs(total);
      int low[2], high[2];
      for (int i = 0; i < 2; ++i) {
        low[i] = std::max(0, int(std::floor(std::min({a[i], b[i], c[i]}) - 0.5)));
        high[i] = std::min(side_px, int(std::ceil(std::max({a[i], b[i], c[i]}) + 0.5)));
      }
      for (int row = low[1]; row < high[1]; ++row) {
        for (int column = low[0]; column < high[0]; ++column) {
          const std::array<double, 2> at{column + 0.5, row + 0.5};
          const std::array<double, 3> w{doubled(b, c, at) / total, doubled(c, a, at) / total,
                                        doubled(a, b, at) / total};
          const std::size_t index = std::size_t(row) * side_px + std::size_t(column);
          if (w[0] < 0.0 || w[1] < 0.0 || w[2] < 0.0 || taken[index]) continue;
          taken[index] = true;
          Pixel& pixel = found[index];
          pixel = {static_cast<std::uint32_t>(index), t, w, {}, area_mm2};
          for (int i = 0; i < 3; ++i) {
            for (int axis = 0; axis < 3; ++axis) {
              pixel.place_mm[axis] += w[i] * positions_mm[t[i]][axis];
            }
          }
        }
      }
    }
    for (std::size_t i = 0; i < map_len; ++i) {
      if (taken[i]) pixels.push_back(found[i]);
    }
  }
};

}  // namespace papilla
