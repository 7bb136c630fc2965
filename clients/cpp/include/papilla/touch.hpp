// Where things are and what pushes back: frames of the protocol. No allocation.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "wire.hpp"

namespace papilla {

/// Numbers of a pose, or of a net force, on the wire.
constexpr std::size_t row_len = 7;

/// Where an object of the hello is in the finger's frame.
struct Pose {
  std::array<float, 3> origin_mm{};
  std::array<float, 4> quaternion{0.0F, 0.0F, 0.0F, 1.0F};  ///< of length one, x y z w
};

/// A net force to be met, in sessions whose hello says `force_target`.
struct NetForce {
  std::array<float, 3> direction{0.0F, 0.0F, 1.0F};         ///< of length one, in the finger's frame
  float force_n = 0.0F;                                     ///< along it; 0: none is asked
};

/// What pushes back on a finger, in its frame.
struct Touch {
  std::array<float, 3> force_n{};
  std::array<float, 3> torque_n_mm{};   ///< about the frame's origin
  float area_mm2 = 0.0F;                ///< in contact, of the deformed skin
  std::array<float, 3> centre_mm{};     ///< of the pressure, on the deformed skin
  float penetration_mm = 0.0F;          ///< of the deepest vertex that is left inside
  float stiffness_n_per_mm = 0.0F;      ///< 0: not asked for
  float travel_mm = 0.0F;               ///< of the things, to meet the net force
  float pressure_max_pa = 0.0F;
  float share = 0.0F;                   ///< of the second order in the displacement
  float solve_us = 0.0F;
};

namespace wire {

constexpr std::size_t touch_bytes = 64;

inline void put_pose(std::uint8_t* at, const Pose& pose) {
  for (std::size_t i = 0; i < 3; ++i) put_float(at + 4 * i, pose.origin_mm[i]);
  for (std::size_t i = 0; i < 4; ++i) put_float(at + 12 + 4 * i, pose.quaternion[i]);
}

inline void put_net(std::uint8_t* at, const NetForce& net) {
  for (std::size_t i = 0; i < row_len; ++i) {
    put_float(at + 4 * i, i < 3 ? net.direction[i] : i == 3 ? net.force_n : 0.0F);
  }
}

/// Reads `touch_bytes` bytes.
inline Touch get_touch(const std::uint8_t* at) {
  const auto value = [&](std::size_t i) { return get_float(at + 4 * i); };
  const auto three = [&](std::size_t i) { return std::array<float, 3>{value(i), value(i + 1), value(i + 2)}; };
  Touch touch;
  touch.force_n = three(0);
  touch.torque_n_mm = three(3);
  touch.area_mm2 = value(6);
  touch.centre_mm = three(7);
  touch.penetration_mm = value(10);
  touch.stiffness_n_per_mm = value(11);
  touch.travel_mm = value(12);
  touch.pressure_max_pa = value(13);
  touch.share = value(14);
  touch.solve_us = value(15);
  return touch;
}

}  // namespace wire
}  // namespace papilla
