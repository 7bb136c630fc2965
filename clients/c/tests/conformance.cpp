// The cases of the conformance scripts that have no wire, by the native library (docs/reference/conformance.md).
// Arguments: folder of models, contact model.
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

// Patterns and expectations of the C++ client, whose answers these are turned into.
#include "../../cpp/tests/checks.hpp"
#include <papilla_c.hpp>

namespace {

// Of sockets, of other sample types than floats, of windows that are sent, of helpers of the clients.
const std::set<std::string> of_the_wire = {
    "f16", "u16", "u8", "mixed-types", "windows", "window-u8", "new-terms", "late", "stale",
    "burst", "latest-wins", "reconnect", "http", "contacts", "addresses", "tokens", "silence", "budget"};

std::vector<float> list(const PapillaSamples& samples) {
  return samples.count ? std::vector<float>(samples.data, samples.data + samples.count) : std::vector<float>();
}

Touch touch_of(const PapillaTouch& from) {
  Touch touch;
  static_assert(sizeof touch == sizeof from);
  std::memcpy(static_cast<void*>(&touch), &from, sizeof touch);
  return touch;
}

class Run {
 public:
  Run(const char* folder, const char* contact) : folder_(folder), contact_(contact) {}

  void step(const Value& step) {
    const std::string& name = step["do"].string;
    if (name == "hello") return hello(step);
    if (name == "frame") return frame(step);
    if (name == "touch") return touch(step);
    if (name == "gaps") return gaps(step);
    must(name == "rasterise", "there is no step " + name);
    rasterise(step);
  }

 private:
  const char* folder_;
  const char* contact_;
  papilla::native::Model model_;
  papilla::native::Session session_;
  PapillaModelInfo info_{};

  void load(const char* tier) {
    must(model_.load(folder_, tier, contact_) == PAPILLA_OK, model_.error());
    must(model_.info(info_) == PAPILLA_OK, model_.error());
  }

  void hello(const Value& step) {
    const Value& expect = step["expect"];
    const std::string tier = step["hello"]["tier"].string;
    // A folder has no model that a case calls unknown: the hello is then refused by another one.
    const bool is_there = std::ifstream(std::string(folder_) + "/" + tier + ".onnx").good() && !tier.empty();
    load(is_there ? tier.c_str() : nullptr);
    const std::string members = json::print(step["hello"]).substr(1);
    const std::string text = R"({"type": "hello", "version": 3)" + std::string(members == "}" ? "" : ",") + members;
    const PapillaStatus status = session_.open(model_, text.c_str());
    const Problem problem{papilla_status_name(status), session_.error(), session_.error_field()};
    must((status == PAPILLA_OK) == (due_status(expect) == "ok"), "the hello: " + problem.code + " " + problem.message);
    if (status != PAPILLA_OK) return check_problem(expect, problem);
    const auto same = [&](const char* member, const Value& due, const std::string& found) {
      must(due.is_null() || json::print(due) == found, std::string(member) + " is " + found);
    };
    const Value& ready = expect["ready"];
    same("tier", ready["tier"], "\"" + std::string(info_.name) + "\"");
    same("atlas_hash", ready["atlas_hash"], "\"" + std::string(info_.atlas_hash) + "\"");
    same("vertices", ready["vertices"], std::to_string(info_.vertex_count));
    same("method", ready["method"], "\"" + std::string(session_.method()) + "\"");
  }

  /// The answer in the C++ client's words.
  Answer answer_of(PapillaStatus status, const PapillaAnswer& from, std::uint8_t finger) {
    Answer to;
    to.status = status == PAPILLA_OK ? Status::ok : Status::error;
    to.problem = {papilla_status_name(status), session_.error(), session_.error_field()};
    to.finger = finger;
    if (status != PAPILLA_OK) return to;
    to.out_of_range = from.flags & PAPILLA_FLAG_OUT_OF_RANGE;
    to.no_contact = from.flags & PAPILLA_FLAG_NO_CONTACT;
    to.unfamiliar = from.flags & PAPILLA_FLAG_UNFAMILIAR;
    to.unsettled = from.flags & PAPILLA_FLAG_UNSETTLED;
    to.cut_off = from.flags & PAPILLA_FLAG_CUT_OFF;
    to.not_tracked = from.flags & PAPILLA_FLAG_NOT_TRACKED;
    to.coarse_clock = from.flags & PAPILLA_FLAG_COARSE_CLOCK;
    to.tier = info_.name;
    const auto px = [](std::uint32_t value) { return static_cast<std::uint16_t>(value); };
    to.window = {px(from.column), px(from.row), px(from.width), px(from.height)};
    to.values = list(from.map);
    // A window of no pixel is a map as well: all of it is zero.
    to.has_map = from.has_sed != 0 && (from.map.count > 0 || from.points.count + from.actuators.count == 0);
    to.pressure_pa = list(from.pressure_pa);
    to.rates_hz = list(from.rates_hz);
    to.points = list(from.points);
    to.point_rates_hz = list(from.point_rates_hz);
    to.actuators = list(from.actuators);
    to.has_summary = from.summary != nullptr;
    if (from.summary) std::memcpy(to.summary.data(), from.summary, sizeof to.summary);
    to.has_touch = from.touch != nullptr;
    if (from.touch) to.touch = touch_of(*from.touch);
    if (const PapillaErrorEstimate* e = from.error_estimate) {
      to.error_estimate = {e->sed_median, e->sed_p90, e->force_median, e->force_p90};
    }
    return to;
  }

  void frame(const Value& step) {
    if (step.has("window")) return;  // whole maps alone are taken
    const std::vector<float> map = pressure(step["pressure"]);
    PapillaAnswer answer{};
    const std::uint64_t time_us = step.has("client_time_us") ? step["client_time_us"].whole() : now_us();
    const PapillaStatus status = session_.send_map(map.data(), map.size(), answer, time_us);
    check_answer(step["expect"], answer_of(status, answer, 0));
  }

  static const PapillaNetForce* net_of(const Value& step, PapillaNetForce& room) {
    const Value& net = step["net"];
    if (net.is_null()) return nullptr;
    for (std::size_t i = 0; i < 3; ++i) room.direction[i] = float(net[i].number);
    room.force_n = float(net[3].number);
    return &room;
  }

  void touch(const Value& step) {
    std::vector<PapillaPose> poses;
    for (const Value& row : step["poses"].items) {
      PapillaPose& pose = poses.emplace_back();
      for (std::size_t i = 0; i < 3; ++i) pose.origin_mm[i] = float(row[i].number);
      for (std::size_t i = 0; i < 4; ++i) pose.quaternion[i] = float(row[3 + i].number);
    }
    PapillaNetForce room{};
    PapillaAnswer answer{};
    const auto finger = std::uint8_t(step["finger"].whole());
    if (step["poses"].is_null()) {
      const PapillaStatus lost = session_.send_not_tracked(answer, now_us(), finger);
      return check_touch(step["expect"], answer_of(lost, answer, finger), finger);
    }
    const PapillaStatus status =
        session_.send_poses(poses.data(), poses.size(), answer, now_us(), finger, net_of(step, room));
    check_touch(step["expect"], answer_of(status, answer, finger), finger);
  }

  /// A value of each vertex of the skin, from its squared distance of `at`.
  template <class Of>
  std::vector<float> at_vertices(const Value& at, const Of& of) {
    std::vector<float> values;
    for (std::uint32_t vertex = 0; vertex < info_.vertex_count; ++vertex) {
      double squared = 0.0;
      for (std::size_t i = 0; i < 3; ++i) {
        const double off = double(info_.skin_mm[3 * vertex + i]) - at[i].number;
        squared += off * off;
      }
      values.push_back(float(of(squared)));
    }
    return values;
  }

  void gaps(const Value& step) {
    const Value& ball = step["sphere"];
    auto depth_mm = at_vertices(ball, [&](double squared) { return ball[3].number - std::sqrt(squared); });
    append_velocity(step, depth_mm);
    PapillaNetForce room{};
    PapillaAnswer answer{};
    const auto finger = std::uint8_t(step["finger"].whole());
    const PapillaStatus status =
        session_.send_gaps(depth_mm.data(), depth_mm.size(), answer, now_us(), finger, net_of(step, room));
    check_touch(step["expect"], answer_of(status, answer, finger), finger);
  }

  void rasterise(const Value& step) {
    load(nullptr);
    const Value& g = step["vertices"]["gaussian_mm"];
    const auto values = at_vertices(g, [&](double squared) {
      return g[4].number * std::exp(-squared / (2.0 * g[3].number * g[3].number));
    });
    std::vector<float> map(PAPILLA_MAP_LEN);
    must(model_.rasterise(values.data(), values.size(), map.data()) == PAPILLA_OK, model_.error());
    check_map(step["expect"], [&](int row, int column) { return map[std::size_t(row * side_px + column)]; });
  }
};

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) return std::puts("conformance MODELS CONTACT_MODEL"), 2;
  std::ifstream file(environment("PAPILLA_CONFORMANCE"));
  std::stringstream text;
  text << file.rdbuf();
  Value script;
  try {
    take_locale();
  } catch (const Nonconformity& error) {
    return std::puts(error.what.c_str()), 2;
  }
  if (!json::parse(text.str(), script)) return std::puts("the script cannot be read"), 2;
  int failed = 0;
  for (const Value& each : script["cases"].items) {
    const std::string& name = each["name"].string;
    if (of_the_wire.count(name)) {
      std::printf("skip %s: of the wire\n", name.c_str());
      continue;
    }
    std::size_t number = 0;
    try {
      Run run(arguments[1], arguments[2]);
      for (const Value& step : each["steps"].items) run.step(step), ++number;
      std::printf("ok %s\n", name.c_str());
    } catch (const Nonconformity& error) {
      ++failed;
      std::printf("FAIL %s: step %zu: %s\n", name.c_str(), number, error.what.c_str());
    }
    std::fflush(stdout);
  }
  return failed != 0;
}
