// Runs the conformance script with the C++ client (docs/reference/conformance.md).
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <sstream>

#include "checks.hpp"
#include "typed.hpp"

namespace {

struct Outcome {
  std::uint32_t sequence;
  Status status;
  bool by_client;
};

class Run {
 public:
  explicit Run(double timeout_s) : timeout_ms_(int(1000 * timeout_s)) {}
  std::string note;

  void step(const Value& step) {
    const std::string& name = step["do"].string;
    const auto steps = std::map<std::string, void (Run::*)(const Value&)>{
        {"hello", &Run::hello},         {"frame", &Run::frame},         {"burst", &Run::burst},
        {"reconnect", &Run::reconnect}, {"http", &Run::post},           {"rasterise", &Run::rasterise},
        {"move", &Run::moved},          {"stay", &Run::stayed},
        {"address", &Run::address},     {"token", &Run::token},
        {"silence", &Run::silence},
        {"contacts", &Run::contacts},   {"touch", &Run::touch},         {"gaps", &Run::gaps}};
    must(steps.count(name) != 0, "there is no step " + name);
    (this->*steps.at(name))(step);
  }

 private:
  int timeout_ms_;
  const std::string url_ = environment("PAPILLA_URL");
  std::mutex mutex_;
  std::vector<Outcome> outcomes_;
  std::unique_ptr<Atlas> atlas_;
  std::uint64_t moved_ = 1;           ///< connections at the last move
  // Last: its threads end before what they use.
  std::unique_ptr<Session> session_;

  void address(const Value& step) {
    const net::Address address = net::Address::of(step["address"].string);
    const Value& expect = step["expect"];
    must(address.fault.empty() == (due_status(expect) == "ok"), step["address"].string + ": " + address.fault);
    if (!address.fault.empty()) {
      must(address.fault.find(expect["says"].string) != std::string::npos, address.fault);
      must(http(step["address"].string, "GET", "/v1/atlas").problem.code == expect["code"].string, "another code");
      Session::Options options;
      options.url = step["address"].string;
      Session session(options);
      return must(!session.open() && session.problem().code == expect["code"].string, "a session has another code");
    }
    must(address.session() == expect["session"].string, "sessions are at " + address.session());
    must(address.http("/v1/atlas") == expect["http"].string, "the atlas is at " + address.http("/v1/atlas"));
  }

  void token(const Value& step) {
    std::string token = step["token"].string;
    const bool good = net::clean_token(token);
    must(good == (due_status(step["expect"]) == "ok"), "the token: " + token);
    if (good) return must(token == step["expect"]["token"].string, "the token is '" + token + "'");
    Session::Options options;
    options.url = url_;
    options.token = step["token"].string;
    Session session(options);
    must(!session.open() && session.problem().code == step["expect"]["code"].string, "another code");
  }

  Session& session() {
    must(session_ != nullptr, "no session is open");
    return *session_;
  }

  void hello(const Value& step) {
    const Value& expect = step["expect"];
    bool good;
    Problem problem;
    if (session_) {
      good = session_->renew(typed::hello(step["hello"]));
      problem = session_->problem();
    } else {
      Session::Options options;
      options.url = url_;
      options.hello = typed::hello(step["hello"]);
      options.on_answer = [this](const Answer& answer) {
        std::lock_guard<std::mutex> lock(mutex_);
        outcomes_.push_back({answer.sequence, answer.status, answer.by_client});
      };
      options.warn = nullptr;
      options.timeout_ms = timeout_ms_;
      auto session = std::make_unique<Session>(std::move(options));
      good = session->open();
      problem = session->problem();
      if (good) session_ = std::move(session);
    }
    must(good == (due_status(expect) == "ok"), "the hello: " + problem.code + " " + problem.message);
    if (!good) return check_problem(expect, problem);
    for (const Value& words : expect["warnings"].items) check_told(words.string);
    const Ready ready = session_->ready();
    for (const auto& [name, due] : expect["ready"].members) {
      must(json::print(ready.message[name]) == json::print(due), "ready." + name + " is another");
    }
  }

  void frame(const Value& step) {
    const std::vector<float> map = pressure(step["pressure"]);
    Window window;
    std::vector<float> samples = map;
    if (const Value& w = step["window"]; !w.is_null()) {
      const auto at = [&](std::size_t i) { return static_cast<std::uint16_t>(w[i].whole()); };
      window = {at(0), at(1), at(2), at(3)};
      samples.clear();
      for (int row = window.row; row < window.row + window.height; ++row) {
        for (int column = window.column; column < window.column + window.width; ++column) {
          const bool inside = row < side_px && column < side_px;
          samples.push_back(inside ? map[std::size_t(row) * side_px + std::size_t(column)] : 0.0F);
        }
      }
    }
    const bool timed = step.has("client_time_us");
    const std::uint64_t attempts = std::max<std::uint64_t>(1, step["attempts"].whole());
    for (std::uint64_t i = 0; i < attempts; ++i) {
      const std::uint64_t time_us = timed ? step["client_time_us"].whole() : now_us();
      const Answer& answer = session().render(samples.data(), window, time_us,
                                              std::uint32_t(step["deadline_us"].whole()), timeout_ms_);
      if (answer.status == Status::lost && i + 1 < attempts) continue;
      must(answer.client_time_us == time_us, "another client time comes back");
      return check_answer(step["expect"], answer);
    }
  }

  void burst(const Value& step) {
    const auto count = std::size_t(step["count"].whole());
    const Value& expect = step["expect"];
    std::vector<std::vector<float>> maps;
    for (std::size_t k = 1; k <= count; ++k) {
      maps.push_back(pressure(step["pressure"], double(k) / double(count)));
    }
    outcomes_.clear();
    const std::uint64_t before = session().superseded_by_client();
    if (step["paused"].boolean) control("pause");
    std::vector<std::uint32_t> sent;
    for (const auto& map : maps) {
      sent.push_back(session().send(map.data()));
      sleep_ms(step["gap_ms"].number);
    }
    if (step["paused"].boolean) control("resume");
    const std::vector<Outcome> found = wait_for_outcomes(count);
    std::set<std::uint32_t> named;
    std::uint32_t last = 0;
    std::size_t superseded = 0, here = 0, good = 0;
    for (const Outcome& outcome : found) {
      named.insert(outcome.sequence);
      must(outcome.status == Status::ok || outcome.status == Status::superseded, name_of(outcome.status));
      here += outcome.by_client;
      if (outcome.status == Status::superseded) {
        ++superseded;
        continue;
      }
      ++good;
      must(outcome.sequence > last, "answers came out of order");
      last = outcome.sequence;
    }
    must(named == std::set<std::uint32_t>(sent.begin(), sent.end()), "two outcomes of one frame");
    must(last == sent.back(), "the newest frame was not rendered last");
    must(here == session().superseded_by_client() - before, "the client miscounts what it superseded");
    must(superseded >= expect["superseded"].whole(), "too few were superseded");
    must(here >= expect["superseded_by_client"].whole(), "the client superseded too few");
    Answer newest;
    must(session().latest(newest) && newest.sequence == last, "latest() gives another answer");
    check_answer(expect["newest"], newest);
    note = " (" + std::to_string(good) + " ok, " + std::to_string(here) + " superseded here, " +
           std::to_string(superseded - here) + " by the service)";
  }

  void reconnect(const Value& step) {
    const std::uint64_t before = session().connections();
    control("restart");
    const std::uint64_t begin = now_us();
    while (session().connections() == before) {
      must(double(now_us() - begin) < 1e6 * step["within_s"].number, "no new session in time");
      sleep_ms(5);
    }
    note = " (connected " + std::to_string(double(now_us() - begin) * 1e-6) + " s after the server was back)";
  }

  void check_told(const std::string& words) {
    const std::vector<std::string> told = session().warnings();
    const auto holds = [&](const std::string& each) { return each.find(words) != std::string::npos; };
    must(std::any_of(told.begin(), told.end(), holds), "nobody was told: " + words);
  }

  /// What became of so many frames, once it is known.
  std::vector<Outcome> wait_for_outcomes(std::size_t count) {
    std::vector<Outcome> found;
    for (int waited = 0; found.size() < count; waited += 5) {
      must(waited < timeout_ms_, "only " + std::to_string(found.size()) + " outcomes");
      sleep_ms(5);
      std::lock_guard<std::mutex> lock(mutex_);
      found = outcomes_;
    }
    return found;
  }

  /// The service stops, or dies, while frames wait for it.
  void silence(const Value& step) {
    const std::uint64_t before = session().connections();
    const std::vector<float> map = pressure(step["pressure"]);
    must(session().render(map.data(), {}, now_us(), 0, timeout_ms_).status == Status::ok, "the frame before");
    session().set_timeout_ms(int(step["timeout_ms"].number));
    control(step["how"].string);
    outcomes_.clear();
    const std::size_t count = step["count"].whole();
    std::uint32_t last = 0;
    for (std::size_t k = 0; k < count; ++k) last = session().send(map.data()), sleep_ms(50);
    const std::vector<Outcome> found = wait_for_outcomes(count);
    for (const Outcome& each : found) {
      const bool is_due = each.status == Status::lost || (each.status == Status::superseded && each.sequence != last);
      must(is_due, std::string("a frame is ") + name_of(each.status));
    }
    check_told("no answer within");
    control(step["how"].string == "pause" ? "resume" : "start");
    session().set_timeout_ms(timeout_ms_);
    const std::uint64_t begin = now_us();
    while (session().connections() == before || !session().connected()) {
      must(double(now_us() - begin) < 1e6 * step["within_s"].number, "no new session in time");
      sleep_ms(5);
    }
  }

  void moved(const Value& step) {
    const std::uint64_t begin = now_us();
    // It may have moved between the steps.
    while (session().connections() == moved_) {
      must(double(now_us() - begin) < 1e6 * step["within_s"].number, "it did not move in time");
      sleep_ms(5);
    }
    moved_ = session().connections();
  }

  /// It was asked to move and could not, and says why.
  void stayed(const Value& step) {
    const std::uint64_t begin = now_us();
    const auto says = [&](const std::string& words) { return words.find(step["says"].string) != std::string::npos; };
    for (;;) {
      const std::vector<std::string> warnings = session().warnings();
      if (std::any_of(warnings.begin(), warnings.end(), says)) break;
      must(double(now_us() - begin) < 1e6 * step["within_s"].number, "it does not say: " + step["says"].string);
      sleep_ms(5);
    }
    must(session().connections() == moved_, "it has moved");
  }

  void post(const Value& step) {
    HttpAnswer answer;
    const std::vector<float> map = sed(pressure(step["pressure"]), url_, step["tier"].string, &answer);
    const bool good = due_status(step["expect"]) == "ok";
    must(map.empty() != good, "status " + std::to_string(answer.status) + " " + answer.problem.message);
    if (!good) return check_problem(step["expect"], answer.problem);
    must(answer.header("x-papilla-tier") == step["expect"]["tier"].string, "another tier");
    check_map(step["expect"], [&](int row, int column) { return map[std::size_t(row * side_px + column)]; });
  }

  const Atlas& atlas() {
    if (!atlas_) {
      atlas_ = std::make_unique<Atlas>();
      must(atlas_->parse(http(url_, "GET", "/v1/atlas").body), "the atlas cannot be read");
    }
    return *atlas_;
  }

  /// The step's net force; null without one.
  static const NetForce* net_of(const Value& step, NetForce& room) {
    const Value& net = step["net"];
    if (net.is_null()) return nullptr;
    for (std::size_t i = 0; i < 3; ++i) room.direction[i] = float(net[i].number);
    room.force_n = float(net[3].number);
    return &room;
  }

  void touch(const Value& step) {
    std::vector<Pose> poses;
    for (const Value& row : step["poses"].items) {
      Pose& pose = poses.emplace_back();
      for (std::size_t i = 0; i < 3; ++i) pose.origin_mm[i] = float(row[i].number);
      for (std::size_t i = 0; i < 4; ++i) pose.quaternion[i] = float(row[3 + i].number);
    }
    NetForce room;
    const auto finger = std::uint8_t(step["finger"].whole());
    if (step["poses"].is_null()) return check_touch(step["expect"], session().not_tracked(finger, timeout_ms_), finger);
    if (step.has("engines")) return placed(step, poses);
    check_touch(step["expect"], session().touch(poses, finger, net_of(step, room), timeout_ms_), finger);
  }

  /// The objects where each engine says that they are.
  void placed(const Value& step, const std::vector<Pose>& due) {
    struct Engine {
      const char* name;
      frames::Convention convention;
      std::optional<frames::Three> up;
    };
    const Engine engines[] = {{"right_handed", frames::metres, {}}, {"openxr", frames::openxr, {}}, {"unity", frames::unity, {}},
                              {"unreal", frames::unreal, {}}, {"godot", frames::openxr, frames::Three{0.0, 0.0, -1.0}}};
    must(step["engines"].members.size() == std::size(engines), "another number of engines");
    for (const auto& [name, convention, up] : engines) {
      const Value& said = step["engines"][name];
      const auto place = [](const Value& seven) {
        frames::Place read;
        for (std::size_t i = 0; i < 3; ++i) read.at[i] = seven[i].number;
        for (std::size_t i = 0; i < 4; ++i) read.turn[i] = seven[3 + i].number;
        return read;
      };
      const frames::Place finger = place(said["finger"]);
      std::vector<Pose> poses;
      for (std::size_t k = 0; k < due.size(); ++k) {
        const frames::Place object = place(said["objects"][k]);
        poses.push_back(check_pose(name, frames::to_finger(convention, finger, object), due[k]));
        if (!said.has("joints")) continue;
        const Value& joints = said["joints"];
        const auto tracked = frames::finger_of_joints(convention, place(joints["distal"]), place(joints["tip"]),
                                                      joints["inside_mm"].number, up ? &*up : nullptr);
        must(tracked.has_value(), std::string(name) + ": no finger of joints");
        check_pose(name, frames::to_finger(convention, *tracked, object), due[k]);
      }
      const Answer& answer = session().touch(poses, 0, nullptr, timeout_ms_);
      check_touch(step["expect"], answer, 0);
      const auto felt = frames::felt(convention, finger, answer.touch);
      const Value& wanted = step["expect"]["engines"][name];
      check_list("force_n", felt->force_n, wanted["force_n"]);
      check_list("torque_n_m", felt->torque_n_m, wanted["torque_n_m"]);
      check_list("centre", felt->centre, wanted["centre"]);
    }
  }

  /// A pose that is the one due: its place within some micrometres, its quaternion up to the sign.
  static Pose check_pose(const std::string& engine, const std::optional<Pose>& found, const Pose& due) {
    must(found.has_value(), engine + ": no pose");
    double dot = 0.0;
    for (std::size_t i = 0; i < 4; ++i) dot += found->quaternion[i] * due.quaternion[i];
    for (std::size_t i = 0; i < 3; ++i) {
      must(std::abs(found->origin_mm[i] - due.origin_mm[i]) < 2e-3, engine + ": the object is elsewhere");
    }
    must(std::abs(dot) > 1.0 - 1e-6, engine + ": the object is turned otherwise");
    return *found;
  }

  void gaps(const Value& step) {
    const Value& sphere = step["sphere"];
    std::vector<float> depth_mm;
    for (const auto& p : atlas().positions_mm) {
      double squared = 0.0;
      for (std::size_t i = 0; i < 3; ++i) squared += (p[i] - sphere[i].number) * (p[i] - sphere[i].number);
      depth_mm.push_back(float(sphere[3].number - std::sqrt(squared)));
    }
    append_velocity(step, depth_mm);
    NetForce room;
    const auto finger = std::uint8_t(step["finger"].whole());
    check_touch(step["expect"], session().touch_gaps(depth_mm, finger, net_of(step, room), timeout_ms_), finger);
  }

  void rasterise(const Value& step) {
    const Value& g = step["vertices"]["gaussian_mm"];
    std::vector<float> values, map(map_len);
    for (const auto& p : atlas().positions_mm) {
      double squared = 0.0;
      for (std::size_t i = 0; i < 3; ++i) squared += (p[i] - g[i].number) * (p[i] - g[i].number);
      values.push_back(float(g[4].number * std::exp(-squared / (2.0 * g[3].number * g[3].number))));
    }
    atlas().rasterise(values.data(), map.data());
    check_map(step["expect"], [&](int row, int column) { return map[std::size_t(row * side_px + column)]; });
  }

  void contacts(const Value& step) {
    std::vector<Contact> contacts;
    for (const Value& c : step["contacts"].items) {
      const Value& at = c["at_mm"];
      contacts.push_back({{at[0].number, at[1].number, at[2].number}, c["force_n"].number,
                          c.has("radius_mm") ? c["radius_mm"].number : 0.0});
    }
    std::vector<float> map(map_len);
    atlas().contacts(contacts.data(), contacts.size(), map.data());
    check_map(step["expect"], [&](int row, int column) { return map[std::size_t(row * side_px + column)]; });
    if (step["expect"].has("force_n")) near("force_n", atlas().force_n(map.data()), step["expect"]["force_n"]);
  }
};

}  // namespace

int main() {
  int failed = 0;
  try {
    take_locale();
    std::ifstream file(environment("PAPILLA_CONFORMANCE"));
    std::stringstream text;
    text << file.rdbuf();
    Value script;
    must(json::parse(text.str(), script), "the script cannot be read");
    for (const Value& each : script["cases"].items) {
      const std::string& name = each["name"].string;
      std::size_t number = 0;
      try {
        Run run(script["timeout_s"].number);
        for (const Value& step : each["steps"].items) run.step(step), ++number;
        std::printf("ok %s%s\n", name.c_str(), run.note.c_str());
      } catch (const Nonconformity& error) {
        ++failed;
        std::printf("FAIL %s: step %zu: %s\n", name.c_str(), number, error.what.c_str());
      }
      std::fflush(stdout);
    }
  } catch (const Nonconformity& error) {
    std::fprintf(stderr, "%s\n", error.what.c_str());
    return 2;
  }
  return failed ? 1 : 0;
}
