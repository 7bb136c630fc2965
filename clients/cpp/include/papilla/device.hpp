// What haptic devices take of a session: intensities from 0 to 1, at the device's own rate, and 0 when answers stop.
// docs/guides/devices.md.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "answer.hpp"

namespace papilla {

/// What to send to a device now.
struct DeviceCommand {
  std::vector<std::vector<float>> levels;  ///< intensity of each actuator, 0 to 1, finger by finger
  float amplitude = 0.0F;                  ///< the greatest of them: for a device with one motor
  double duration_s = 0.0;                 ///< how long the device may hold it if no other follows
};

/// Intensities of an answer, from 0 to 1; false: it says nothing about them.
using ReadLevels = std::function<bool(const Answer&, std::vector<float>&)>;

namespace detail {

/// The difference, where it is above 0.
inline double above(const char* name, double value, double least) {
  if (std::isfinite(value) && value > least) return value - least;
  throw std::invalid_argument(std::string(name) + " has to be above " + std::to_string(least));
}

}  // namespace detail

/// One intensity: the size of the force on the finger, 0 at `threshold_n` and 1 from `full_n` on. Of pressure maps the
/// effect `summary` has the force.
inline ReadLevels device_force(double full_n, double threshold_n = 0.0) {
  const double span_n = detail::above("full_n", full_n, threshold_n);
  return [=](const Answer& answer, std::vector<float>& levels) {
    if (!answer.has_touch && !answer.has_summary && !answer.no_contact) {
      throw NotCarried("force", "send objects or gaps, or name the effect 'summary' in the hello");
    }
    const double x = answer.touch.force_n[0], y = answer.touch.force_n[1], z = answer.touch.force_n[2];
    // Not std::hypot of three: GCC's takes NaN for 0.
    const double size_n = std::sqrt(x * x + y * y + z * z);
    const double found_n = answer.has_touch ? size_n : answer.has_summary ? double(answer.summary[force_n]) : 0.0;
    levels.assign(1, float((found_n - threshold_n) / span_n));
    return true;
  };
}

/// An intensity for each actuator of the effect `actuators`; `full` is its `max`.
inline ReadLevels device_actuators(double full = 1.0) {
  detail::above("full", full, 0.0);
  return [=](const Answer& answer, std::vector<float>& levels) {
    if (answer.actuators.empty()) throw NotCarried("actuators", "name the effect 'actuators' in the hello");
    levels.clear();
    for (const float value : answer.actuators) levels.push_back(float(double(value) / full));
    return true;
  };
}

/// One intensity of the effect `spikes`: the mean firing rate of the units of some classes, 1 from `full_hz` on. Most
/// units lie outside of a contact: a few Hz are much. It remembers the frame before: make one for each finger.
inline ReadLevels device_spike_rate(const json::Value& units, double full_hz, std::vector<std::string> classes = {"ra", "pc"}) {
  if (units.size() == 0) throw NotCarried("spikes", "name the effect 'spikes' in the hello");
  detail::above("full_hz", full_hz, 0.0);
  std::vector<bool> mine;
  for (const json::Value& unit : units.items) {
    mine.push_back(std::find(classes.begin(), classes.end(), unit["class"].string) != classes.end());
  }
  const auto count = double(std::count(mine.begin(), mine.end(), true));
  if (count == 0.0) throw std::invalid_argument("no unit of the session is of these classes");
  std::optional<std::uint64_t> last_us;
  return [=](const Answer& answer, std::vector<float>& levels) mutable {
    const bool later = last_us && answer.client_time_us > *last_us;
    // The service computes the last 50 ms of a longer pause.
    const double seconds = later ? std::min(1e-6 * double(answer.client_time_us - *last_us), 0.05) : 0.0;
    last_us = answer.client_time_us;
    if (!later) return false;
    const auto fired = std::count_if(answer.spikes.begin(), answer.spikes.end(), [&](const Spike& each) { return mine[each.unit]; });
    levels.assign(1, float(double(fired) / (count * seconds * full_hz)));
    return true;
  };
}

/// A device with one or more fingers. It holds what the last answer of each finger said for `hold_s`, and then fades it to
/// 0 within `fade_s`: so it falls silent when answers stop, whatever the reason. Feed and poll it on one thread.
class Device {
 public:
  struct Options {
    std::size_t fingers = 1;
    double max_hz = 90.0;  ///< commands a second that the device takes
    double hold_s = 0.05;
    double fade_s = 0.05;
    std::function<double()> clock_s;  ///< seconds that only rise; empty: the steady clock
  };

  explicit Device(ReadLevels read) : Device(std::move(read), Options()) {}
  Device(ReadLevels read, const Options& options) : Device(std::vector<ReadLevels>(options.fingers, std::move(read)), options) {}
  /// One reader for each finger.
  Device(std::vector<ReadLevels> readers, Options options) : readers_(std::move(readers)), options_(std::move(options)) {
    detail::above("max_hz", options_.max_hz, 0.0);
    detail::above("hold_s", options_.hold_s, 0.0);
    detail::above("fade_s", options_.fade_s, 0.0);
    values_.assign(readers_.size(), std::vector<float>(1, 0.0F));
    at_s_.assign(readers_.size(), never);
  }

  /// Takes the next answer, of any finger. One without a value (late, lost, refused) counts as none.
  void feed(const Answer& answer) {
    if (answer.finger >= readers_.size()) throw std::invalid_argument("finger " + std::to_string(answer.finger) + " is none of the device");
    if (answer.status != Status::ok) return;
    if (answer.not_tracked) {
      at_s_[answer.finger] = never;
      return;
    }
    if (!readers_[answer.finger](answer, found_)) return;
    // What is no number drives no motor: the finger fades as without an answer.
    if (!std::all_of(found_.begin(), found_.end(), [](float each) { return std::isfinite(each); })) return;
    for (float& each : found_) each = std::clamp(each, 0.0F, 1.0F);
    values_[answer.finger] = found_;
    at_s_[answer.finger] = now_s();
  }

  /// What is due; nothing before the device takes another command, or as long as it is silent anyway.
  std::optional<DeviceCommand> poll() {
    const double now = now_s();
    if (now < next_s_) return std::nullopt;
    DeviceCommand command = command_at(now, options_.hold_s + options_.fade_s);
    const bool silent = command.amplitude == 0.0F;
    if (silent && silent_) return std::nullopt;
    silent_ = silent;
    next_s_ = now + 1.0 / options_.max_hz;
    return command;
  }

  /// All at 0 from now on, whatever the rate: for the end of a program, or a lost device.
  DeviceCommand stop() {
    at_s_.assign(at_s_.size(), never);
    silent_ = true;
    return command_at(now_s(), 0.0);
  }

 private:
  static constexpr double never = -std::numeric_limits<double>::infinity();

  double now_s() const {
    if (options_.clock_s) return options_.clock_s();
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }

  DeviceCommand command_at(double now, double duration_s) const {
    DeviceCommand command{values_, 0.0F, duration_s};
    for (std::size_t finger = 0; finger < values_.size(); ++finger) {
      const double left = std::clamp(1.0 - (now - at_s_[finger] - options_.hold_s) / options_.fade_s, 0.0, 1.0);
      for (float& each : command.levels[finger]) {
        each = float(double(each) * left);
        command.amplitude = std::max(command.amplitude, each);
      }
    }
    return command;
  }

  std::vector<ReadLevels> readers_;
  Options options_;
  std::vector<std::vector<float>> values_;
  std::vector<float> found_;
  std::vector<double> at_s_;
  double next_s_ = never;
  bool silent_ = true;
};

}  // namespace papilla
