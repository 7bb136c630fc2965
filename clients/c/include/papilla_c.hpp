// C++17 over papilla_c.h: handles that free themselves. No exceptions: every call returns a status, and
// the handle says more.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "papilla_c.h"

namespace papilla::native {

/// A folder of models. Sessions keep what they were opened with.
class Model {
 public:
  /// tier and contact may be null.
  PapillaStatus load(const char* folder, const char* tier = nullptr, const char* contact = nullptr) {
    return papilla_model_load(handle_.get(), folder, tier, contact);
  }
  PapillaStatus info(PapillaModelInfo& info) { return papilla_model_info(handle_.get(), &info); }
  /// `map` has room for PAPILLA_MAP_LEN.
  PapillaStatus rasterise(const float* values, std::size_t count, float* map) {
    return papilla_model_rasterise(handle_.get(), values, count, map);
  }
  const char* error() const { return papilla_model_error(handle_.get()); }
  const PapillaModel* handle() const { return handle_.get(); }

 private:
  struct Free {
    void operator()(PapillaModel* model) const { papilla_model_free(model); }
  };
  std::unique_ptr<PapillaModel, Free> handle_{papilla_model_new()};
};

/// One hand. Calls of one session must not overlap; answers point into it until the next call.
class Session {
 public:
  PapillaStatus open(const Model& model, const char* hello) {
    return papilla_session_open(handle_.get(), model.handle(), hello);
  }
  PapillaStatus send_map(const float* pressure_pa, std::size_t count, PapillaAnswer& answer,
                         std::uint64_t time_us = 0, std::uint8_t finger = 0) {
    return papilla_send_map(handle_.get(), finger, pressure_pa, count, time_us, &answer);
  }
  PapillaStatus send_poses(const PapillaPose* poses, std::size_t count, PapillaAnswer& answer, std::uint64_t time_us = 0,
                           std::uint8_t finger = 0, const PapillaNetForce* net = nullptr) {
    return papilla_send_poses(handle_.get(), finger, poses, count, net, time_us, &answer);
  }
  PapillaStatus send_gaps(const float* depth_mm, std::size_t count, PapillaAnswer& answer, std::uint64_t time_us = 0,
                          std::uint8_t finger = 0, const PapillaNetForce* net = nullptr) {
    return papilla_send_gaps(handle_.get(), finger, depth_mm, count, net, time_us, &answer);
  }
  /// Tracking is lost: better than a pose that is not true.
  PapillaStatus send_not_tracked(PapillaAnswer& answer, std::uint64_t time_us = 0, std::uint8_t finger = 0) {
    return papilla_send_not_tracked(handle_.get(), finger, time_us, &answer);
  }
  /// How pressure is found, as "pixels"; empty where frames are pressure.
  const char* method() const { return papilla_session_method(handle_.get()); }
  /// What the hello cannot have as one might expect, a line each; empty if there is nothing.
  const char* warning() const { return papilla_session_warning(handle_.get()); }
  const char* error() const { return papilla_session_error(handle_.get()); }
  const char* error_field() const { return papilla_session_error_field(handle_.get()); }

 private:
  struct Free {
    void operator()(PapillaSession* session) const { papilla_session_free(session); }
  };
  std::unique_ptr<PapillaSession, Free> handle_{papilla_session_new()};
};

}  // namespace papilla::native
