/// Poses of engines to poses in the finger's frame, and forces back (docs/reference/frames-and-units.md).
///
/// The finger's frame: its origin is the foremost point of the skin, x runs back along the finger, y to the
/// right as the finger points ahead with the nail up, z out of the nail; mm, right-handed.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "touch.hpp"

namespace papilla::frames {

using Three = std::array<double, 3>;
using Quaternion = std::array<double, 4>;  ///< x y z w

/// An engine's axes and its unit of length. Member i along the finger's axes is `sign[i]` times the engine's
/// member `from[i]`; an object's axes and its shape's are related in the same way.
struct Convention {
  std::array<std::size_t, 3> from;
  Three sign;
  double handed;   ///< 1: right-handed; -1: left-handed
  double unit_mm;  ///< mm in a unit of length
};

/// The finger's own axes, metres: where you say how a body's axes lie.
inline constexpr Convention metres{{0, 1, 2}, {1.0, 1.0, 1.0}, 1.0, 1000.0};
/// x right, y up, -z ahead, to the fingertip: OpenXR, WebXR, Godot.
inline constexpr Convention openxr{{2, 0, 1}, {1.0, 1.0, 1.0}, 1.0, 1000.0};
/// Left-handed: x right, y up, z ahead.
inline constexpr Convention unity{{2, 0, 1}, {-1.0, 1.0, 1.0}, -1.0, 1000.0};
/// Left-handed, cm: x ahead, y right, z up.
inline constexpr Convention unreal{{0, 1, 2}, {-1.0, 1.0, 1.0}, -1.0, 10.0};

/// Where a body is in the engine's world. The quaternion need not be of length one.
struct Place {
  Three at{0.0, 0.0, 0.0};
  Quaternion turn{0.0, 0.0, 0.0, 1.0};
};

/// What pushes back on the finger, in the engine's world; an object feels the opposite.
struct Felt {
  Three force_n;
  Three torque_n_m;  ///< about the finger's origin; in a left-handed world by the left hand's rule
  Three centre;      ///< of the pressure, in the engine's unit of length
};

namespace detail {

inline Three cross(const Three& a, const Three& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double dot(const Three& a, const Three& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Three plus(const Three& a, const Three& b, double times = 1.0) {
  return {a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]};
}

/// The vector, turned; `turn` is of length one.
inline Three turned(const Quaternion& turn, const Three& v) {
  const Three axis{turn[0], turn[1], turn[2]};
  const Three doubled = plus({0.0, 0.0, 0.0}, cross(axis, v), 2.0);
  return plus(plus(v, doubled, turn[3]), cross(axis, doubled));
}

/// Hamilton's product: turns by b, then by a.
inline Quaternion times(const Quaternion& a, const Quaternion& b) {
  const Three u{a[0], a[1], a[2]}, v{b[0], b[1], b[2]};
  const Three axis = plus(plus(cross(u, v), v, a[3]), u, b[3]);
  return {axis[0], axis[1], axis[2], a[3] * b[3] - dot(u, v)};
}

inline Quaternion back(const Quaternion& turn) { return {-turn[0], -turn[1], -turn[2], turn[3]}; }

/// With a quaternion of length one; none where a number is not finite or the quaternion is zero.
inline std::optional<Place> checked(const Place& place) {
  double squared = 0.0;
  for (const double v : place.turn) squared += v * v;
  if (!std::isfinite(place.at[0] + place.at[1] + place.at[2]) || !std::isfinite(squared) || squared < 1e-12) return std::nullopt;
  Place found = place;
  for (double& v : found.turn) v /= std::sqrt(squared);
  return found;
}

inline Three to_frame(const Convention& c, const Three& v) {
  return {c.sign[0] * v[c.from[0]], c.sign[1] * v[c.from[1]], c.sign[2] * v[c.from[2]]};
}
inline Three to_engine(const Convention& c, const Three& v) {
  Three out{};
  for (std::size_t i = 0; i < 3; ++i) out[c.from[i]] = c.sign[i] * v[i];
  return out;
}
inline Three doubles(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

/// The quaternion of the rotation whose matrix has these columns.
inline Quaternion of_columns(const Three& x, const Three& y, const Three& z) {
  const double trace = x[0] + y[1] + z[2];
  Quaternion q;
  if (trace > 0.0) {
    q = {y[2] - z[1], z[0] - x[2], x[1] - y[0], 1.0 + trace};
  } else if (x[0] >= y[1] && x[0] >= z[2]) {
    q = {1.0 + x[0] - y[1] - z[2], x[1] + y[0], x[2] + z[0], y[2] - z[1]};
  } else if (y[1] >= z[2]) {
    q = {x[1] + y[0], 1.0 - x[0] + y[1] - z[2], y[2] + z[1], z[0] - x[2]};
  } else {
    q = {x[2] + z[0], y[2] + z[1], 1.0 - x[0] - y[1] + z[2], x[1] - y[0]};
  }
  return checked(Place{{}, q})->turn;
}

}  // namespace detail

/// Where an object is in the finger's frame, for `Session::send_poses`; none where a number is not finite, a
/// quaternion zero or `scale` (how many times as large as life all is drawn) not above 0: skip that frame.
inline std::optional<Pose> to_finger(const Convention& convention, const Place& finger, const Place& object, double scale = 1.0) {
  const std::optional<Place> f = detail::checked(finger), o = detail::checked(object);
  if (!f || !o || !(scale > 0.0) || !std::isfinite(scale)) return std::nullopt;
  const Quaternion back = detail::back(f->turn);
  const Three at = detail::to_frame(convention, detail::turned(back, detail::plus(o->at, f->at, -1.0)));
  const Quaternion own = detail::times(back, o->turn);
  // A turn's axis is mirrored with the axes, and its sense once more.
  const Three axis = detail::to_frame(convention, {own[0], own[1], own[2]});
  Pose pose;
  for (std::size_t i = 0; i < 3; ++i) {
    pose.origin_mm[i] = static_cast<float>(at[i] * convention.unit_mm / scale);
    pose.quaternion[i] = static_cast<float>(convention.handed * axis[i]);
  }
  pose.quaternion[3] = static_cast<float>(own[3]);
  return pose;
}

/// The finger's place in the engine's world, of two tracked joints: that of the distal phalanx and the tip. It
/// points from the one to the other, its nail the way of the distal joint's axis `up` (null: the engine's own,
/// which is OpenXR's y). The tip's joint is the frame's origin, or lies `inside_mm` behind it. Left and right
/// hands are the same: the model's finger is symmetric. None where a joint is no place, both are the same, or
/// `up` points along the finger.
inline std::optional<Place> finger_of_joints(const Convention& convention, const Place& distal, const Place& tip, double inside_mm = 0.0, const Three* up = nullptr) {
  const std::optional<Place> d = detail::checked(distal), t = detail::checked(tip);
  if (!d || !t || !std::isfinite(inside_mm)) return std::nullopt;
  Three back = detail::plus(d->at, t->at, -1.0);
  const double length = std::sqrt(detail::dot(back, back));
  if (length * convention.unit_mm < 1.0) return std::nullopt;
  for (double& v : back) v /= length;
  const Three axis = up ? *up : detail::to_engine(convention, {0.0, 0.0, 1.0});
  Three nail = detail::turned(d->turn, axis);
  nail = detail::plus(nail, back, -detail::dot(nail, back));
  const double size = std::sqrt(detail::dot(nail, nail));
  if (!(size >= 1e-3)) return std::nullopt;
  for (double& v : nail) v /= size;
  // Where the finger's axes point in the world, and with them the engine's axes of the finger.
  const std::array<Three, 3> frame{back, detail::plus({}, detail::cross(nail, back), convention.handed), nail};
  std::array<Three, 3> columns;
  for (std::size_t i = 0; i < 3; ++i) columns[convention.from[i]] = detail::plus({}, frame[i], convention.sign[i]);
  return Place{detail::plus(t->at, back, -inside_mm / convention.unit_mm), detail::of_columns(columns[0], columns[1], columns[2])};
}

/// What pushes back on the finger, in the engine's world; none as of `to_finger`.
inline std::optional<Felt> felt(const Convention& convention, const Place& finger, const Touch& touch, double scale = 1.0) {
  const std::optional<Place> f = detail::checked(finger);
  if (!f || !(scale > 0.0) || !std::isfinite(scale)) return std::nullopt;
  const auto out = [&](const std::array<float, 3>& v) {
    return detail::turned(f->turn, detail::to_engine(convention, detail::doubles(v)));
  };
  return Felt{out(touch.force_n), detail::plus({}, out(touch.torque_n_mm), 1e-3 * convention.handed),
              detail::plus(f->at, out(touch.centre_mm), scale / convention.unit_mm)};
}

/// A vertex of an object's mesh, in its own axes in the engine, for the `vertices_mm` of a hello. Triangles of
/// Unity and Godot are clockwise seen from outside: turn them. Unreal's come out right.
inline Three vertex_mm(const Convention& convention, const Three& point) {
  return detail::plus({}, detail::to_frame(convention, point), convention.unit_mm);
}

/// A place of the finger's frame, as of the atlas, in the drawn finger's own axes; see `vertex_mm`.
inline Three vertex_drawn(const Convention& convention, const Three& point_mm) {
  return detail::plus({}, detail::to_engine(convention, point_mm), 1.0 / convention.unit_mm);
}

}  // namespace papilla::frames
