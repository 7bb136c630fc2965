// A session without its socket: what is said, what is sent next, what became of each frame.
// Knows no thread and no transport, so that an engine can bring its own (clients/unreal).
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "answer.hpp"

namespace papilla {

/// Microseconds of a steady clock.
inline std::uint64_t now_us() {
  using namespace std::chrono;
  return static_cast<std::uint64_t>(
      duration_cast<microseconds>(steady_clock::now().time_since_epoch()).count());
}

class Core {
 public:
  /// `reconnect`: the service asks for it, of clients whose hello says that they follow.
  enum class Event { nothing, ready, refused, broken, reconnect };

  /// Called with every outcome, once a frame. `Answer` is reused: copy what has to stay.
  std::function<void(const Answer&)> on_answer;
  /// Called with what people should know, each thing once.
  std::function<void(const std::string&)> on_warning;

  /// `hello`: members of the protocol's hello as JSON without braces, as
  /// `"tier": "small", "sample_type": "u16"`.
  explicit Core(std::string hello = {}) : hello_(std::move(hello)) { sent_.reserve(sent_max); }

  std::string hello() const { return hello_text(hello_); }
  static std::string hello_text(const std::string& members) {
    return "{\"type\":\"hello\",\"version\":" + std::to_string(protocol_version) +
           (members.empty() ? "" : "," + members) + "}";
  }
  /// Whether the members of a hello can be read; `problem` says where not.
  static bool is_readable(const std::string& members, Problem& problem) {
    json::Value hello;
    std::size_t stop = 0;
    if (json::parse("{" + members + "}", hello, &stop)) return true;
    const std::string near = members.substr(std::min(members.size(), stop > 12 ? stop - 12 : 0), 24);
    problem = {"bad_json", "the hello is no JSON near '" + near + "': its members are due, without braces, as "
               "\"budget_us\": 11000, and numbers with a point, whatever the locale", "hello"};
    return false;
  }
  /// Members of a hello of a client that moves when it is asked to.
  static std::string following(const std::string& members) {
    return (members.empty() ? "" : members + ", ") + "\"reconnect\": true";
  }
  /// To be said to the old connection: asks for what the service remembers.
  const char* ask_for_seal() {
    ++seals_due_;
    return "{\"type\": \"seal\"}";
  }
  /// Once for each that came, or was refused: whether it is the one asked for last. Others are of moves that were given up.
  bool is_last_seal() { return --seals_due_ == 0; }
  /// The service did not say what it remembers: the session stays where it is.
  void stay(const std::string& why) {
    const std::string words = "the service asked the session to move, and did not say what it remembers (" + why +
                              "): it goes on over its old connection, and starts anew when that ends";
    if (is_new(words)) tell(words);
  }
  /// Whether a binary message is that: it begins with PPS.
  static bool is_sealed(const std::uint8_t* bytes, std::size_t size) {
    return size > 3 && bytes[0] == 'P' && bytes[1] == 'P' && bytes[2] == 'S';
  }
  /// Said to the new connection, before the sealed message.
  std::string resuming() const { return hello_text(hello_ + ", \"resume\": true"); }
  /// What to say again after a reconnect.
  void set_hello(std::string hello) { hello_ = std::move(hello); }

  bool is_ready() const { return is_ready_; }
  const Ready& ready() const { return history_.back(); }
  const Problem& refusal() const { return refusal_; }
  bool waiting() const { return outbox_.any(); }
  /// Whether `take` would give a frame.
  bool can_take() const { return is_ready_ && outbox_.any() && sent_.size() < sent_max; }
  std::size_t in_flight() const { return sent_.size(); }
  /// Fingers of the session.
  std::size_t fingers() const { return ready().fingers; }
  std::uint64_t superseded_by_client() const { return superseded_; }

  /// Takes a frame: the samples of a window, Pa, row by row (none: no contact). Replaces one of the
  /// finger that has not left. Returns its sequence. Copies; allocates nothing.
  std::uint32_t send(const float* pressure_pa, Window window, std::uint64_t client_time_us,
                     std::uint32_t deadline_us = 0, std::uint8_t finger = 0) {
    if (!pressure_pa) window = {0, 0, 0, 0};
    // A window larger than the map goes without samples: the service says what is wrong with it.
    const std::size_t count = window.pixels() > map_len ? 0 : window.pixels();
    const SampleType type = history_.back().sample_type;
    Header header;
    header.sample_type = type;
    header.finger = finger;
    header.window = window;
    header.client_time_us = client_time_us;
    header.time_us = deadline_us;
    header.scale = scale_for(type, pressure_pa, count);
    Outgoing& frame = put(header, count * sample_bytes(type));
    encode_samples(type, pressure_pa, count, header.scale, frame.data() + header_bytes);
    return frame.id.sequence;
  }

  /// Takes where the objects of the hello are (at most 16), as `send` takes a map.
  std::uint32_t send_poses(const Pose* poses, std::size_t count, std::uint64_t client_time_us,
                           std::uint8_t finger = 0, const NetForce* net = nullptr) {
    const std::size_t rows = count + (net ? 1 : 0);
    const auto height = static_cast<std::uint16_t>(std::min<std::size_t>(rows, objects_max + 1));
    Header header = header_of(Kind::objects, {0, 0, row_len, height}, client_time_us, finger);
    Outgoing& frame = put(header, 4 * row_len * height);
    std::uint8_t* at = frame.data() + header_bytes;
    for (std::size_t i = 0; i < std::min(count, std::size_t{height}); ++i, at += 4 * row_len) {
      wire::put_pose(at, poses[i]);
    }
    if (net && rows == height) wire::put_net(at, *net);
    return frame.id.sequence;
  }

  /// Takes how deep the undeformed skin lies in things, mm, negative in air: 224 x 224, or a value
  /// a vertex, as the hello says; with its "velocity", x y z mm/s of each vertex behind them.
  std::uint32_t send_gaps(const float* depth_mm, std::size_t count, std::uint64_t client_time_us,
                          std::uint8_t finger = 0, const NetForce* net = nullptr) {
    count = std::min(count, map_len);
    const bool is_map = count == map_len;
    const Window window = is_map ? Window{} : Window{0, 0, static_cast<std::uint16_t>(count), 1};
    Header header = header_of(Kind::gaps, window, client_time_us, finger);
    Outgoing& frame = put(header, 4 * (count + (net ? row_len : 0)));
    encode_samples(SampleType::f32, depth_mm, count, 1.0F, frame.data() + header_bytes);
    if (net) wire::put_net(frame.data() + header_bytes + 4 * count, *net);
    return frame.id.sequence;
  }

  /// Takes that nobody knows where things are, or what presses: tracking is lost. The answer is zero, and what the
  /// service remembers waits for the next frame.
  std::uint32_t send_not_tracked(std::uint64_t client_time_us, std::uint8_t finger = 0) {
    // Of any session: kind and sample type of a frame without samples mean nothing.
    Header header = header_of(Kind::pressure, {0, 0, 0, 0}, client_time_us, finger);
    header.flags = wire::not_tracked;
    return put(header, 0).id.sequence;
  }

  /// The frame that waits, if there is one and a session to send it in; it then counts as sent.
  /// The bytes stay until the next call. A frame encoded for older terms is encoded anew.
  Outgoing* take() {
    if (!can_take()) return nullptr;
    outbox_.take(leaving_);
    recode(leaving_);
    sent_.push_back({leaving_.id, history_.size() - 1});
    return &leaving_;
  }

  /// The connection broke: what was sent is lost; what waits goes on waiting.
  void lost() {
    is_ready_ = false;
    seals_due_ = 0;
    for (const Sent& sent : sent_) outcome(sent.id, Status::lost);
    sent_.clear();
  }

  /// Ends frames that were handed over longer ago than `timeout_us` and have no outcome: they are lost. True
  /// where one of them had left: nothing more is to be expected of this connection.
  bool expire(std::uint64_t timeout_us) {
    const std::uint64_t now = now_us();
    const std::uint64_t born_us = now > timeout_us ? now - timeout_us : 0;
    bool any = false;
    outbox_.clear([&](const Outgoing& frame) { any = true, outcome(frame.id, Status::lost); }, born_us);
    bool had_left = false;
    for (std::size_t i = 0; i < sent_.size();) {
      if (sent_[i].id.born_us > born_us) {
        ++i;
        continue;
      }
      const FrameId id = sent_[i].id;
      sent_.erase(sent_.begin() + static_cast<std::ptrdiff_t>(i));
      had_left = true;
      outcome(id, Status::lost);
    }
    if ((any || had_left) && is_new("timeout")) tell("no answer within " + number::print(double(timeout_us) * 1e-6) + " s; such frames are lost");
    return had_left;
  }

  /// What people were told: each question of the service's, and each odd outcome, once.
  const std::vector<std::string>& warnings() const { return warnings_; }

  /// No more sessions will follow.
  void end() {
    lost();
    outbox_.clear([this](const Outgoing& frame) { outcome(frame.id, Status::lost); });
  }

  /// A text message: ready, refused (see `refusal`), or the error of a frame (its outcome).
  Event text(std::string_view message) {
    json::Value value;
    if (!json::parse(message, value)) return Event::broken;
    if (value["type"].string == "ready") return agree(value);
    if (value["type"].string == "reconnect") return Event::reconnect;
    const Problem problem{value["code"].string, value["message"].string, value["field"].string};
    if (!value.has("sequence")) return refusal_ = problem, Event::refused;
    const auto sequence = static_cast<std::uint32_t>(value["sequence"].whole());
    Sent sent;
    if (forget(sequence, sent)) {
      scratch_.problem = problem;
      outcome(sent.id, Status::error);
    }
    return Event::nothing;
  }

  /// A binary message: the answer to a frame.
  Event binary(const std::uint8_t* bytes, std::size_t size) {
    Header header;
    Sent sent;
    if (!wire::decode(bytes, size, header)) return Event::broken;
    if (!forget(header.sequence, sent)) return Event::nothing;
    const Ready& ready = history_[sent.ready];
    if (ready.map.there && !header.window.inside()) return Event::broken;
    Answer& answer = scratch_;
    answer.out_of_range = (header.flags & wire::out_of_range) != 0;
    answer.no_contact = (header.flags & wire::no_contact) != 0;
    answer.unfamiliar = (header.flags & wire::unfamiliar) != 0;
    answer.cut_off = (header.flags & wire::cut_off) != 0;
    answer.unsettled = (header.flags & wire::unsettled) != 0;
    answer.not_tracked = (header.flags & wire::not_tracked) != 0;
    answer.coarse_clock = (header.flags & wire::coarse_clock) != 0;
    answer.window = header.window;
    answer.total_us = header.time_us;
    answer.queue_us = header.queue_us;
    answer.infer_us = header.infer_us;
    answer.tier.clear();
    for (const Ready& each : history_) {
      if (each.tier_number == header.tier) answer.tier = each.tier;
    }
    const auto& names = ready.message["tier_names"].items;
    if (header.tier < names.size()) answer.tier = names[header.tier].string;
    if (header.status == Status::ok && !read(bytes, size, header, ready)) return Event::broken;
    outcome(sent.id, header.status);
    return Event::nothing;
  }

 private:
  struct Sent {
    FrameId id;
    std::size_t ready = 0;            ///< place in history_
  };
  static constexpr std::size_t sent_max = 256;
  static constexpr std::size_t objects_max = 16;

  std::string hello_;
  std::vector<Ready> history_ = std::vector<Ready>(1);
  bool is_ready_ = false;
  Problem refusal_;
  std::uint32_t sequence_ = 0;
  Outbox outbox_;
  Outgoing leaving_;
  std::vector<Sent> sent_;
  std::vector<float> recoded_ = std::vector<float>(map_len);
  std::uint64_t superseded_ = 0;
  int seals_due_ = 0;
  Answer scratch_;
  static constexpr std::size_t said_max = 100;
  std::vector<std::string> said_, warnings_;

  Event agree(const json::Value& message) {
    Ready ready;
    if (!sample_type_of(message["sample_type"].string, ready.sample_type)) return Event::broken;
    ready.tier = message["tier"].string;
    ready.tier_number = message["tier_number"].whole();
    ready.pressure_max_pa = static_cast<float>(message["pressure_max_pa"].number);
    ready.atlas_hash = message["atlas_hash"].string;
    for (const json::Value& section : message["sections"].items) {
      Ready::Section* const at = ready.section(section["name"].string);
      if (at) *at = {section["offset"].whole(), section["bytes"].whole(), true};
    }
    ready.fingers = message.has("fingers") ? message["fingers"].whole() : 1;
    ready.message = message;
    // Reserved here, so that no answer allocates.
    scratch_.values.reserve(map_len);
    scratch_.pressure_pa.reserve(ready.pressure.bytes / 4);
    scratch_.shear_pa.reserve(ready.shear.bytes / 4);
    scratch_.displacement_mm.reserve(ready.displacement.bytes / 4);
    scratch_.spikes.reserve(ready.spikes.bytes / spike_bytes);
    scratch_.vertices.reserve(ready.vertices.bytes);
    scratch_.rates_hz.reserve(ready.rates.bytes);
    scratch_.points.reserve(ready.points.bytes / 4);
    scratch_.point_rates_hz.reserve(ready.point_rates.bytes / 4);
    scratch_.actuators.reserve(ready.actuators.bytes / 4);
    history_.push_back(std::move(ready));
    is_ready_ = true;
    question(message);
    return Event::ready;
  }

  static constexpr std::size_t spikes_head_bytes = 8, spike_bytes = 4;

  /// Two numbers, then for each spike its unit and how long before the frame it was, us.
  static bool read_spikes(const std::uint8_t* bytes, std::size_t size, const Ready::Section& section,
                          std::uint64_t client_time_us, Answer& answer) {
    answer.spikes.clear();
    answer.spikes_total = 0;
    if (!section.there) return true;
    if (section.bytes < spikes_head_bytes || section.offset + section.bytes > size) return false;
    const std::uint8_t* const at = bytes + section.offset;
    const auto count = wire::get<std::uint32_t>(at + 4);
    if (count > (section.bytes - spikes_head_bytes) / spike_bytes) return false;
    answer.spikes_total = wire::get<std::uint32_t>(at);
    const auto frame_us = static_cast<std::int64_t>(client_time_us);
    for (const std::uint8_t* one = at + spikes_head_bytes; answer.spikes.size() < count; one += spike_bytes) {
      answer.spikes.push_back({wire::get<std::uint16_t>(one), frame_us - wire::get<std::uint16_t>(one + 2)});
    }
    return true;
  }

  bool read(const std::uint8_t* bytes, std::size_t size, const Header& header, const Ready& ready) {
    const auto floats = [&](const Ready::Section& section, float* to) {
      if (section.offset + section.bytes > size) return false;
      decode_samples(SampleType::f32, bytes + section.offset, section.bytes / 4, 1.0F, to);
      return true;
    };
    Answer& answer = scratch_;
    answer.has_touch = ready.touch.there && ready.touch.offset + wire::touch_bytes <= size;
    if (answer.has_touch) answer.touch = wire::get_touch(bytes + ready.touch.offset);
    answer.pressure_pa.resize(ready.pressure.bytes / 4);
    if (!floats(ready.pressure, answer.pressure_pa.data())) return false;
    answer.shear_pa.resize(ready.shear.bytes / 4);
    if (!floats(ready.shear, answer.shear_pa.data())) return false;
    answer.displacement_mm.resize(ready.displacement.bytes / 4);
    if (!floats(ready.displacement, answer.displacement_mm.data())) return false;
    answer.error_estimate = {};
    if (ready.error_estimate.there) {
      std::array<float, 4> errors{};
      if (ready.error_estimate.bytes != sizeof errors || !floats(ready.error_estimate, errors.data())) return false;
      answer.error_estimate = {errors[0], errors[1], errors[2], errors[3]};
    }
    if (!read_spikes(bytes, size, ready.spikes, header.client_time_us, answer)) return false;
    answer.vertices.resize(ready.vertices.bytes / sample_bytes(header.sample_type));
    if (ready.vertices.offset + ready.vertices.bytes > size) return false;
    decode_samples(header.sample_type, bytes + ready.vertices.offset, answer.vertices.size(), header.scale,
                   answer.vertices.data());
    answer.has_summary = ready.summary.there && ready.summary.bytes == 64;
    answer.rates_hz.clear();
    if (ready.rates.there) {
      if (ready.rates.bytes < wire::rates_head_bytes || ready.rates.offset + ready.rates.bytes > size) return false;
      const std::uint8_t* const at = bytes + ready.rates.offset;
      answer.rates_hz.resize((ready.rates.bytes - wire::rates_head_bytes) / sample_bytes(header.sample_type));
      decode_samples(header.sample_type, at + wire::rates_head_bytes, answer.rates_hz.size(), wire::get_float(at),
                     answer.rates_hz.data());
    }
    answer.point_rates_hz.resize(ready.point_rates.bytes / 4);
    if (!floats(ready.point_rates, answer.point_rates_hz.data())) return false;
    answer.points.resize(ready.points.bytes / 4);
    answer.actuators.resize(ready.actuators.bytes / 4);
    if (answer.has_summary && !floats(ready.summary, answer.summary.data())) return false;
    if (!floats(ready.points, answer.points.data())) return false;
    if (!floats(ready.actuators, answer.actuators.data())) return false;
    answer.has_map = ready.map.there;
    if (!answer.has_map) return true;
    const std::size_t count = header.window.pixels();
    if (ready.map.offset + count * sample_bytes(header.sample_type) > size) return false;
    answer.values.resize(count);
    decode_samples(header.sample_type, bytes + ready.map.offset, count, header.scale,
                   answer.values.data());
    return true;
  }

  bool forget(std::uint32_t sequence, Sent& found) {
    for (std::size_t i = 0; i < sent_.size(); ++i) {
      if (sent_[i].id.sequence != sequence) continue;
      found = sent_[i];
      sent_.erase(sent_.begin() + static_cast<std::ptrdiff_t>(i));
      return true;
    }
    return false;
  }

  /// Whether nothing of that code was told yet; from now on something was.
  bool is_new(std::string_view code) {
    if (std::find(said_.begin(), said_.end(), code) != said_.end() || said_.size() >= said_max) return false;
    said_.emplace_back(code);
    return true;
  }

  void tell(std::string words) {
    warnings_.push_back(std::move(words));
    if (on_warning) on_warning(warnings_.back());
  }

  /// Says what a program that looks at maps alone would not see. Allocates where there is something new.
  void warn(const Answer& answer) {
    if (answer.status == Status::error && is_new("error")) tell("a frame was refused: " + answer.problem.message);
    if (answer.status == Status::ok && answer.out_of_range && is_new("out_of_range")) {
      tell("pressure is beyond what tier " + answer.tier + " knows; such answers are flagged");
    }
    if (answer.status == Status::ok && answer.coarse_clock && is_new("coarse_clock")) {
      tell("the times of the frames have steps above 20 ms, stand still, or are in ms or ns in place of us; rates, "
           "spikes and creep in such answers are wrong, and flagged coarse_clock");
    }
  }

  /// What the service asks, and a budget that it cannot meet.
  void question(const json::Value& ready) {
    for (const json::Value& each : ready["warnings"].items) {
      const std::string words = each["member"].string + ": " + each["question"].string;
      if (is_new(words)) tell(words);
    }
    const json::Value& meets = ready["meets_budget"];
    if (meets.type != json::Value::Type::boolean || meets.boolean) return;
    const std::string budget = number::print(ready["budget_us"].number);
    std::string words = "a frame of tier " + ready["tier"].string + " takes some " +
                        number::print(ready["predicted_latency_us"].number) + " us, and budget_us is " + budget +
                        ", so that frames may be late";
    if (ready["budget_us"].number < 100.0) words += "; it counts microseconds: were " + budget + " ms meant?";
    if (is_new(words)) tell(words);
  }

  void outcome(const FrameId& id, Status status, bool by_client = false) {
    Answer& answer = scratch_;
    answer.sequence = id.sequence;
    answer.client_time_us = id.client_time_us;
    answer.finger = id.finger;
    answer.status = status;
    answer.by_client = by_client;
    if (status != Status::error) answer.problem = {};
    const bool was_answered = status == Status::ok || ((status == Status::late || status == Status::stale ||
                                                        status == Status::superseded) && !by_client);
    if (!was_answered) answer.forget_head();
    if (status != Status::ok) answer.forget_values();
    if (status == Status::ok || status == Status::error) warn(answer);
    if (on_answer) on_answer(answer);
  }

  static Header header_of(Kind kind, Window window, std::uint64_t client_time_us, std::uint8_t finger) {
    Header header;
    header.kind = kind;
    header.window = window;
    header.client_time_us = client_time_us;
    header.finger = finger;
    return header;
  }

  /// Room for the finger's next frame, its header written; what waited is superseded.
  Outgoing& put(Header& header, std::size_t payload_bytes) {
    if (const Outgoing* const old = outbox_.waiting(header.finger)) {
      ++superseded_;
      outcome(old->id, Status::superseded, true);
    }
    header.sequence = ++sequence_;
    Outgoing& frame = outbox_.put(header.finger);
    wire::encode(header, frame.data());
    frame.size = header_bytes + payload_bytes;
    frame.id = {header.sequence, header.client_time_us, header.finger, now_us()};
    return frame;
  }

  /// A frame that was encoded before the terms changed. Poses and gaps are f32 in all of them.
  void recode(Outgoing& frame) {
    std::uint8_t* at = frame.data();
    if (at[5] != static_cast<std::uint8_t>(Kind::pressure) || frame.size == header_bytes) return;
    const auto old = static_cast<SampleType>(at[6]);
    const SampleType now = history_.back().sample_type;
    if (old == now) return;
    const std::size_t count = (frame.size - header_bytes) / sample_bytes(old);
    decode_samples(old, at + header_bytes, count, wire::get_float(at + 28), recoded_.data());
    const float scale = scale_for(now, recoded_.data(), count);
    at[6] = static_cast<std::uint8_t>(now);
    wire::put_float(at + 28, scale);
    encode_samples(now, recoded_.data(), count, scale, at + header_bytes);
    frame.size = header_bytes + count * sample_bytes(now);
  }
};

}  // namespace papilla
