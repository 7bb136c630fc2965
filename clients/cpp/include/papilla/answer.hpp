// What becomes of a frame, and what a session agreed to.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "json.hpp"
#include "outbox.hpp"

namespace papilla {

/// An error of the service's; `code` is one of docs/reference/protocol-errors.md's.
struct Problem {
  std::string code;
  std::string message;
  std::string field;
};

/// The sixteen numbers of a summary, by name; formulas in docs/reference/protocol-effects.md.
enum SummaryMember : std::size_t {
  force_n, contact_area_mm2, pressure_max_pa, pressure_u_px, pressure_v_px, sed_max_j_per_m3,
  sed_max_u_px, sed_max_v_px, sed_integral_uj_per_m, sed_u_px, sed_v_px, sed_uu_px2, sed_uv_px2,
  sed_vv_px2, sed_mean_j_per_m3, sa1_rate_hz
};

/// How wrong an answer is likely to be, by what it shows: relative errors against finite elements. What is not
/// stated is infinite.
struct ErrorEstimate {
  float sed_median = std::numeric_limits<float>::infinity();    ///< half of such maps of SED err less (relative L2)
  float sed_p90 = std::numeric_limits<float>::infinity();       ///< nine of ten such maps err less
  float force_median = std::numeric_limits<float>::infinity();  ///< the same of the size of the force that contact found
  float force_p90 = std::numeric_limits<float>::infinity();
};

/// A unit fired: its number in ready's `units`, and when, by the client's clock.
struct Spike {
  std::uint16_t unit = 0;
  std::int64_t time_us = 0;
};

/// An answer was asked for what its session does not carry.
struct NotCarried : std::logic_error {
  NotCarried(const char* member, const char* advice)
      : std::logic_error(std::string("the answer carries no ") + member + ": " + advice) {}
};

/// The outcome of one frame.
struct Answer {
  std::uint32_t sequence = 0;
  Status status = Status::lost;
  bool by_client = false;             ///< superseded here: the frame never left
  Problem problem;                    ///< with status error
  bool out_of_range = false;          ///< a pressure is above what the tier was trained on
  bool no_contact = false;            ///< the map is zero; no network was asked
  bool cut_off = false;               ///< the contact reaches the edge of the atlas
  bool unfamiliar = false;            ///< rougher or heavier than any map the tier was trained on
  bool unsettled = false;             ///< the contact solve did not settle: its answer is rough
  bool not_tracked = false;           ///< to `send_not_tracked`: all is zero
  bool coarse_clock = false;          ///< the client's clock ticks so coarsely, or counts ms or ns, that rates and spikes may be far off
  std::uint8_t finger = 0;
  std::string tier;
  Window window{0, 0, 0, 0};          ///< of `values`
  std::uint64_t client_time_us = 0;
  std::uint32_t total_us = 0;         ///< in the server, of which
  std::uint32_t queue_us = 0;         ///< waiting for a thread
  std::uint32_t infer_us = 0;         ///< in the network
  bool has_map = false;
  std::vector<float> values;          ///< SED of the window, J/m3, row by row
  bool has_touch = false;
  Touch touch;                        ///< of poses and of gaps
  std::vector<float> pressure_pa;     ///< that was found, if asked for: a map, or a value a vertex
  std::vector<float> shear_pa;        ///< traction along the skin, x y z a vertex in the finger's frame, if asked for
  std::vector<float> displacement_mm; ///< how far the skin has moved, x y z a vertex in the finger's frame, if asked for
  std::vector<float> vertices;        ///< SED at the atlas' vertices, if asked for in place of a map
  ErrorEstimate error_estimate;
  bool has_summary = false;
  std::array<float, 16> summary{};    ///< see SummaryMember
  std::vector<float> rates_hz;        ///< firing rates, a whole map or a value a vertex: the effect `afferents`
  std::vector<float> points;          ///< SED at the points, J/m3
  std::vector<float> point_rates_hz;  ///< firing rates there: the effect `afferents`
  std::vector<float> actuators;
  std::vector<Spike> spikes;          ///< who fired since the answer before, in the order of time: the effect `spikes`
  std::uint32_t spikes_total = 0;     ///< of the finger since the hello, those too that no answer carried; modulo 2^32

  /// Nothing of another frame is left in an answer that was not rendered; memory stays.
  void forget_values() {
    has_map = has_touch = has_summary = false;
    window = {0, 0, 0, 0};
    touch = {};
    error_estimate = {};
    summary = {};
    spikes.clear();
    spikes_total = 0;
    for (auto* const list :
         {&values, &pressure_pa, &shear_pa, &displacement_mm, &vertices, &rates_hz, &points, &point_rates_hz, &actuators}) {
      list->clear();
    }
  }
  void forget_head() {
    out_of_range = no_contact = cut_off = unfamiliar = unsettled = not_tracked = coarse_clock = false;
    total_us = queue_us = infer_us = 0;
    tier.clear();
  }

  /// The firing rate at a pixel, Hz. Throws `NotCarried` where the answer has no map of rates: the hello has to
  /// name the effect `afferents`.
  float rate_hz(int row, int column) const {
    if (rates_hz.size() != map_len) throw NotCarried("rates_hz", "name the effect 'afferents' in the hello");
    return rates_hz[std::size_t(row) * side_px + std::size_t(column)];
  }
  /// SED at a pixel, J/m3; 0 outside of the window. Throws `NotCarried` where the answer has no map.
  float sed(int row, int column) const {
    if (!has_map) throw NotCarried("sed", status == Status::ok ? "the hello asks for no map" : "the frame was not rendered");
    return at(row, column);
  }

  /// SED at a pixel of the map, J/m3; 0 outside of the window and without a map.
  float at(int row, int column) const {
    const int r = row - window.row, c = column - window.column;
    const bool inside = has_map && r >= 0 && c >= 0 && r < window.height && c < window.width;
    return inside ? values[std::size_t(r) * window.width + std::size_t(c)] : 0.0F;
  }
  float max() const {
    float top = 0.0F;
    for (const float value : values) top = value > top ? value : top;
    return has_map ? top : 0.0F;
  }
};

/// What the service agreed to.
struct Ready {
  struct Section {
    std::size_t offset = 0;
    std::size_t bytes = 0;
    bool there = false;
  };
  json::Value message;                ///< as it came
  std::size_t fingers = 1;
  SampleType sample_type = SampleType::f32;
  std::string tier;
  std::uint64_t tier_number = 0;
  float pressure_max_pa = 0.0F;
  std::string atlas_hash;
  Section touch, pressure, shear, displacement, error_estimate, vertices, summary, rates, points, point_rates, actuators, spikes, map;

  /// The section of that name; null if there is no such section.
  Section* section(std::string_view name) {
    return name == "touch"         ? &touch
           : name == "pressure"    ? &pressure
           : name == "shear"       ? &shear
           : name == "displacement" ? &displacement
           : name == "error_estimate" ? &error_estimate
           : name == "vertices"    ? &vertices
           : name == "summary"     ? &summary
           : name == "rates"       ? &rates
           : name == "points"      ? &points
           : name == "point_rates" ? &point_rates
           : name == "actuators"   ? &actuators
           : name == "spikes"      ? &spikes
           : name == "map"         ? &map
                                   : nullptr;
  }
};

}  // namespace papilla
