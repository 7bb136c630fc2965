// The script of devices, clients/conformance/devices.json (the argument), as every client runs it: without a service, on a
// clock of its own.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>

#include <papilla/papilla.hpp>

using namespace papilla;
using json::Value;

static double now_s = 0.0, tolerance = 0.0;
static int failures = 0;
static std::string case_name;

static void must(bool good, const std::string& what) {
  if (!good) ++failures, std::printf("FAILED: %s: %s\n", case_name.c_str(), what.c_str());
}
static void near(const char* what, double found, double due) {
  must(std::abs(found - due) <= tolerance, std::string(what) + " is " + std::to_string(found) + ", not " + std::to_string(due));
}

static double number_of(const Value& said) {
  if (said.type == Value::Type::number) return said.number;
  return said.string == "nan" ? std::nan("") : std::numeric_limits<double>::infinity();
}
static double number_or(const Value& said, const char* name, double usual) { return said.has(name) ? number_of(said[name]) : usual; }

static ReadLevels reader_of(const Value& said) {
  if (said.has("force")) return device_force(number_of(said["force"]["full_n"]), number_or(said["force"], "threshold_n", 0.0));
  if (said.has("actuators")) return device_actuators(said["actuators"]["full"].number);
  Value units;
  for (const Value& name : said["spike_rate"]["units"].items) {
    Value unit;
    unit.members.emplace_back("class", name);
    units.items.push_back(unit);
  }
  return device_spike_rate(units, said["spike_rate"]["full_hz"].number);
}

static Device device_of(const Value& said) {
  Device::Options options;
  options.fingers = static_cast<std::size_t>(number_or(said, "fingers", 1));
  options.max_hz = number_or(said, "max_hz", options.max_hz);
  options.hold_s = number_or(said, "hold_s", options.hold_s);
  options.fade_s = number_or(said, "fade_s", options.fade_s);
  options.clock_s = [] { return now_s; };
  return Device(reader_of(said), options);
}

static Answer answer_of(const Value& said) {
  Answer answer;
  const std::string& status = said["status"].string;
  answer.status = status == "late"         ? Status::late
                  : status == "superseded" ? Status::superseded
                  : status == "lost"       ? Status::lost
                  : status == "stale"      ? Status::stale
                  : status == "error"      ? Status::error
                                           : Status::ok;
  answer.finger = static_cast<std::uint8_t>(number_or(said, "finger", 0));
  answer.client_time_us = said["client_time_us"].whole();
  answer.no_contact = said["no_contact"].boolean;
  answer.not_tracked = said["not_tracked"].boolean;
  answer.has_touch = said.has("force_n");
  for (std::size_t k = 0; answer.has_touch && k < 3; ++k) answer.touch.force_n[k] = float(number_of(said["force_n"][k]));
  answer.has_summary = said.has("summary_force_n");
  if (answer.has_summary) answer.summary[force_n] = float(said["summary_force_n"].number);
  for (const Value& value : said["actuators"].items) answer.actuators.push_back(float(value.number));
  for (const Value& unit : said["spikes"].items) answer.spikes.push_back({static_cast<std::uint16_t>(unit.number), 0});
  return answer;
}

static void compare(const std::optional<DeviceCommand>& command, const Value& due) {
  must(command.has_value() == !due.is_null(), due.is_null() ? "a command" : "no command");
  if (!command || due.is_null()) return;
  for (std::size_t finger = 0; finger < due["levels"].size(); ++finger) {
    const std::vector<float>& found = command->levels.at(finger);
    for (std::size_t k = 0; k < due["levels"][finger].size(); ++k) {
      near("level", k < found.size() ? double(found[k]) : 0.0, due["levels"][finger][k].number);
    }
  }
  near("amplitude", double(command->amplitude), due["amplitude"].number);
  near("duration", command->duration_s, due["duration_s"].number);
}

template <class Error, class Act>
static void throws(Act act) {
  try {
    act();
  } catch (const Error&) {
    return;
  }
  must(false, "nothing is thrown");
}

static void run(const Value& one) {
  if (one["refused"].boolean) return throws<std::invalid_argument>([&] { device_of(one["device"]); });
  Device device = device_of(one["device"]);
  for (const Value& step : one["steps"].items) {
    now_s = step["at_s"].number;
    if (step.has("stop")) {
      compare(device.stop(), step["stop"]);
    } else if (!step.has("feed")) {
      compare(device.poll(), step["poll"]);
    } else if (step["refused"].boolean) {
      throws<std::invalid_argument>([&] { device.feed(answer_of(step["feed"])); });
    } else if (step["not_carried"].boolean && one["device"].has("spike_rate")) {
      // An answer of this client cannot tell none fired from none carried.
    } else if (step["not_carried"].boolean) {
      throws<NotCarried>([&] { device.feed(answer_of(step["feed"])); });
    } else {
      device.feed(answer_of(step["feed"]));
    }
  }
}

int main(int count, char** arguments) {
  std::ifstream file(count == 2 ? arguments[1] : "");
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  Value script;
  if (!json::parse(text, script) || script["cases"].size() == 0) {
    std::printf("no script: devices FILE\n");
    return 2;
  }
  tolerance = script["tolerance"].number;
  for (const Value& one : script["cases"].items) {
    case_name = one["name"].string;
    run(one);
  }
  if (failures) std::printf("%d checks failed\n", failures);
  else std::printf("checks: %zu\n", script["cases"].size());
  return failures ? 1 : 0;
}
