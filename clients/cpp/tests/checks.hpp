// Inputs of the conformance script, and what was found against what is due.
#pragma once

#include <algorithm>
#include <clocale>
#include <cmath>
#include <cstdlib>
#include <locale>
#include <string>
#include <thread>
#include <vector>

#include <papilla/papilla.hpp>

using namespace papilla;
using json::Value;

struct Nonconformity {
  std::string what;
};

inline void must(bool good, const std::string& what) {
  if (!good) throw Nonconformity{what};
}

inline std::string environment(const char* name) {
  const char* const value = std::getenv(name);
  must(value != nullptr, std::string(name) + " is not set");
  return value;
}

/// Takes the environment's locale, as a desktop's program does, where PAPILLA_DECIMAL says with which decimal point.
inline void take_locale() {
  const char* const due = std::getenv("PAPILLA_DECIMAL");
  if (!due) return;
  must(std::setlocale(LC_ALL, "") != nullptr, "there is no such locale here");
  std::locale::global(std::locale(""));
  must(std::string(std::localeconv()->decimal_point) == due, "the locale's decimal point is another");
}

inline void control(const std::string& action) {
  const HttpAnswer answer = http(environment("PAPILLA_CONTROL"), "POST", "/" + action);
  must(answer.status == 200, "the control refuses " + action + ": " + answer.problem.message);
}

/// Behind the depths of a step of gaps, how fast the thing at each vertex moves, if the step says so.
inline void append_velocity(const Value& step, std::vector<float>& depth_mm) {
  if (!step.has("velocity")) return;
  const std::size_t vertices = depth_mm.size();
  for (std::size_t k = 0; k < 3 * vertices; ++k) depth_mm.push_back(float(step["velocity"][k % 3].number));
}

inline void sleep_ms(double ms) {
  std::this_thread::sleep_for(std::chrono::microseconds(static_cast<long long>(1000 * ms)));
}

inline std::vector<float> pressure(const Value& pattern, double share = 1.0) {
  std::vector<float> map(map_len);
  for (std::size_t i = 0; i < map_len; ++i) {
    const double u = double(i % side_px) + 0.5, v = double(i / side_px) + 0.5;
    double sum = 0.0;
    const auto squared = [&](const Value& of) {
      return (u - of[0].number) * (u - of[0].number) + (v - of[1].number) * (v - of[1].number);
    };
    for (const Value& g : pattern["gaussians"].items) {
      sum += g[3].number * std::exp(-squared(g) / (2.0 * g[2].number * g[2].number));
    }
    const Value& disc = pattern["disc"];
    if (!disc.is_null() && squared(disc) <= disc[2].number * disc[2].number) sum += disc[3].number;
    map[i] = static_cast<float>(sum < 1.0 ? 0.0 : share * sum);
  }
  if (const Value& bad = pattern["bad"]; !bad.is_null()) {
    float& sample = map[bad[0].whole() * side_px + bad[1].whole()];
    sample = bad[2].string == "nan"   ? std::nanf("")
             : bad[2].string == "inf" ? HUGE_VALF
                                      : static_cast<float>(bad[2].number);
  }
  return map;
}

inline void near(const std::string& what, double found, const Value& due, std::size_t at = 0) {
  const double off = std::abs(found - due[at].number);
  must(off <= due[at + 1].number, what + " is " + std::to_string(found) + ", " +
                                      std::to_string(due[at].number) + " is due");
}

template <class List>
void check_list(const char* what, const List& found, const Value& due) {
  must(found.size() == due.size(), std::string(what) + ": another number of values");
  for (std::size_t i = 0; i < due.size(); ++i) near(what + std::to_string(i), found[i], due[i]);
}

/// How wrong the answer says that it may be: what is null is infinite.
inline void check_errors(const Value& expect, const ErrorEstimate& found) {
  if (!expect.has("error_estimate")) return;
  const Value& due = expect["error_estimate"];
  const float numbers[] = {found.sed_median, found.sed_p90, found.force_median, found.force_p90};
  must(due.size() == std::size(numbers), "error_estimate: another number of values");
  for (std::size_t i = 0; i < due.size(); ++i) {
    const std::string what = "error_estimate" + std::to_string(i);
    if (due[i].is_null()) {
      must(numbers[i] == std::numeric_limits<float>::infinity(), what + " is not infinite");
    } else {
      near(what, numbers[i], due[i]);
    }
  }
}

template <class At>
void check_map(const Value& expect, const At& at) {
  double sum = 0.0, top = 0.0;
  for (int row = 0; row < side_px; ++row) {
    for (int column = 0; column < side_px; ++column) {
      sum += at(row, column);
      top = std::max<double>(top, at(row, column));
    }
  }
  for (const Value& pixel : expect["pixels"].items) {
    near("pixel", at(int(pixel[0].number), int(pixel[1].number)), pixel, 2);
  }
  if (expect.has("sum")) near("sum", sum, expect["sum"]);
  if (expect.has("max")) near("max", top, expect["max"]);
}

inline void check_problem(const Value& expect, const Problem& problem) {
  must(problem.code == expect["code"].string, "the code is " + problem.code + ": " + problem.message);
  must(!expect.has("field") || problem.field == expect["field"].string, "the field is " + problem.field);
}

inline const char* name_of(Status status) {
  constexpr const char* names[] = {"ok", "superseded", "late", "error", "stale", "lost"};
  return names[static_cast<int>(status)];
}

inline std::string due_status(const Value& expect) {
  return expect.has("status") ? expect["status"].string : "ok";
}

inline void check_answer(const Value& expect, const Answer& answer) {
  const std::string status = name_of(answer.status);
  must(status == due_status(expect), "the status is " + status + " " + answer.problem.message);
  if (answer.status == Status::error) check_problem(expect, answer.problem);
  if (answer.status != Status::ok) return;
  if (expect.has("tier")) must(answer.tier == expect["tier"].string, "the tier is " + answer.tier);
  if (expect.has("flags")) {
    const auto check = [&](const char* name, bool is_set) {
      const auto& flags = expect["flags"].items;
      const bool due = std::any_of(flags.begin(), flags.end(), [&](const Value& flag) { return flag.string == name; });
      must(is_set == due, std::string(name) + (is_set ? " is set" : " is not set"));
    };
    check("out_of_range", answer.out_of_range);
    check("no_contact", answer.no_contact);
    check("unfamiliar", answer.unfamiliar);
    check("cut_off", answer.cut_off);
    check("not_tracked", answer.not_tracked);
    check("coarse_clock", answer.coarse_clock);
  }
  must(answer.queue_us + answer.infer_us <= answer.total_us, "parts take longer than the whole");
  if (expect.has("map")) {
    must(!answer.has_map, "the answer carries a map");
  } else {
    must(answer.has_map, "the answer carries no map");
    check_map(expect, [&](int row, int column) { return answer.at(row, column); });
  }
  if (const Value& due = expect["window"]; !due.is_null()) {
    const Window& w = answer.window;
    must(w.column == due[0].number && w.row == due[1].number && w.width == due[2].number &&
             w.height == due[3].number, "another window");
  }
  if (expect.has("summary")) {
    must(answer.has_summary, "there is no summary");
    check_list("summary", answer.summary, expect["summary"]);
  }
  if (expect.has("points")) check_list("points", answer.points, expect["points"]);
  if (expect.has("point_rates")) check_list("point_rates", answer.point_rates_hz, expect["point_rates"]);
  if (expect.has("rates")) {
    check_map(expect["rates"], [&](int row, int column) { return answer.rate_hz(row, column); });
  } else {
    must(answer.rates_hz.empty(), "the answer carries rates");
  }
  if (expect.has("actuators")) check_list("actuators", answer.actuators, expect["actuators"]);
  check_errors(expect, answer.error_estimate);
}

inline void check_touch(const Value& expect, const Answer& answer, std::uint8_t finger) {
  const std::string status = name_of(answer.status);
  must(status == due_status(expect), "the status is " + status + " " + answer.problem.message);
  must(answer.finger == finger, "another finger");
  if (answer.status == Status::error) return check_problem(expect, answer.problem);
  must(answer.has_touch, "there is no touch");
  const Touch& t = answer.touch;
  const auto& [fx, fy, fz] = t.force_n;
  const auto& [tx, ty, tz] = t.torque_n_mm;
  const auto& [cx, cy, cz] = t.centre_mm;
  const std::vector<float> found = {fx, fy, fz, tx, ty, tz, t.area_mm2, cx, cy, cz, t.penetration_mm,
                                    t.stiffness_n_per_mm, t.travel_mm, t.pressure_max_pa, t.share};
  check_list("touch", found, expect["touch"]);
  if (expect.has("pressure_sum")) {
    double sum = 0.0;
    for (const float value : answer.pressure_pa) sum += value;
    near("pressure_sum", sum, expect["pressure_sum"]);
  }
  must(answer.no_contact == (expect["flags"].size() > 0), "no_contact is another");
  must(answer.not_tracked == (expect["flags"].size() == 2), "not_tracked is another");
  must(!answer.out_of_range && !answer.unsettled, "out of range or unsettled");
  check_errors(expect, answer.error_estimate);
}
