// A session without its socket: what is said, what is sent next, what became of each frame.
// Knows no thread and no transport, so that an engine can bring its own (clients/unreal).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "answer.hpp"

namespace papilla {

class Core {
 public:
  enum class Heard { nothing, ready, refused, broken };

  /// Called with every outcome, once a frame. `Answer` is reused: copy what has to stay.
  std::function<void(const Answer&)> on_outcome;

  /// `hello`: members of the protocol's hello as JSON without braces, as
  /// `"tier": "small", "sample_type": "u16"`.
  explicit Core(std::string hello = {}) : hello_(std::move(hello)) { sent_.reserve(sent_max); }

  std::string hello() const { return words(hello_); }
  static std::string words(const std::string& members) {
    return "{\"type\":\"hello\",\"version\":2" + (members.empty() ? "" : "," + members) + "}";
  }
  /// What to say again after a reconnect.
  void set_hello(std::string hello) { hello_ = std::move(hello); }

  bool agreed() const { return agreed_; }
  const Terms& terms() const { return history_.back(); }
  const Problem& refusal() const { return refusal_; }
  bool waiting() const { return is_waiting_; }
  /// Whether `take` would give a frame.
  bool can_take() const { return is_waiting_ && agreed_ && sent_.size() < sent_max; }
  std::size_t in_flight() const { return sent_.size(); }
  std::uint64_t superseded_by_client() const { return replaced_; }

  /// Takes a frame: the samples of a window, Pa, row by row (none: no contact). Replaces one that
  /// has not left. Returns its sequence. Copies; allocates nothing.
  std::uint32_t send(const float* pressure_pa, Window window, std::uint64_t client_time_us,
                     std::uint32_t deadline_us = 0) {
    if (is_waiting_) {
      ++replaced_;
      outcome(waiting_.sequence, waiting_.client_time_us, Status::superseded, true);
    }
    if (!pressure_pa) window = {0, 0, 0, 0};
    // A window larger than the map goes without samples: the service says what is wrong with it.
    const std::size_t count = window.pixels() > map_len ? 0 : window.pixels();
    const SampleType type = history_.back().sample_type;
    Header header;
    header.sample_type = type;
    header.sequence = ++sequence_;
    header.window = window;
    header.client_time_us = client_time_us;
    header.time_us = deadline_us;
    header.scale = scale_for(type, pressure_pa, count);
    wire::encode(header, waiting_.data());
    encode_samples(type, pressure_pa, count, header.scale, waiting_.data() + header_bytes);
    waiting_.size = header_bytes + count * sample_bytes(type);
    waiting_.sequence = header.sequence;
    waiting_.client_time_us = client_time_us;
    is_waiting_ = true;
    return header.sequence;
  }

  /// The frame that waits, if there is one and a session to send it in; it then counts as sent.
  /// The bytes stay until the next call. A frame encoded for older terms is encoded anew.
  Outgoing* take() {
    if (!can_take()) return nullptr;
    is_waiting_ = false;
    std::swap(waiting_, leaving_);
    recode(leaving_);
    sent_.push_back({leaving_.sequence, leaving_.client_time_us, history_.size() - 1});
    return &leaving_;
  }

  /// The connection broke: what was sent is lost; what waits goes on waiting.
  void lost() {
    agreed_ = false;
    for (const Sent& sent : sent_) outcome(sent.sequence, sent.client_time_us, Status::lost);
    sent_.clear();
  }

  /// No more sessions will follow.
  void end() {
    lost();
    if (is_waiting_) outcome(waiting_.sequence, waiting_.client_time_us, Status::lost);
    is_waiting_ = false;
  }

  /// A text message: ready, refused (see `refusal`), or the error of a frame (its outcome).
  Heard text(std::string_view message) {
    json::Value value;
    if (!json::parse(message, value)) return Heard::broken;
    if (value["type"].string == "ready") return agree(value);
    const Problem problem{value["code"].string, value["message"].string, value["field"].string};
    if (!value.has("sequence")) return refusal_ = problem, Heard::refused;
    const auto sequence = static_cast<std::uint32_t>(value["sequence"].whole());
    Sent sent;
    if (forget(sequence, sent)) {
      scratch_.problem = problem;
      outcome(sequence, sent.client_time_us, Status::error);
    }
    return Heard::nothing;
  }

  /// A binary message: the answer to a frame.
  Heard binary(const std::uint8_t* bytes, std::size_t size) {
    Header header;
    Sent sent;
    if (!wire::decode(bytes, size, header) || !header.window.inside()) return Heard::broken;
    if (!forget(header.sequence, sent)) return Heard::nothing;
    const Terms& terms = history_[sent.terms];
    Answer& answer = scratch_;
    answer.kind = header.kind;
    answer.flags = header.flags;
    answer.window = header.window;
    answer.total_us = header.time_us;
    answer.queue_us = header.queue_us;
    answer.infer_us = header.infer_us;
    answer.tier.clear();
    for (const Terms& each : history_) {
      if (each.tier_number == header.tier) answer.tier = each.tier;
    }
    if (header.status == Status::ok && !read(bytes, size, header, terms)) return Heard::broken;
    outcome(header.sequence, header.client_time_us, header.status);
    return Heard::nothing;
  }

 private:
  struct Sent {
    std::uint32_t sequence = 0;
    std::uint64_t client_time_us = 0;
    std::size_t terms = 0;
  };
  static constexpr std::size_t sent_max = 256;

  std::string hello_;
  std::vector<Terms> history_ = std::vector<Terms>(1);
  bool agreed_ = false;
  Problem refusal_;
  std::uint32_t sequence_ = 0;
  Outgoing waiting_, leaving_;
  bool is_waiting_ = false;
  std::vector<Sent> sent_;
  std::vector<float> recoded_ = std::vector<float>(map_len);
  std::uint64_t replaced_ = 0;
  Answer scratch_;

  Heard agree(const json::Value& ready) {
    Terms terms;
    if (!sample_type_of(ready["sample_type"].string, terms.sample_type)) return Heard::broken;
    terms.tier = ready["tier"].string;
    terms.tier_number = ready["tier_number"].whole();
    terms.pressure_max_pa = static_cast<float>(ready["pressure_max_pa"].number);
    terms.atlas_hash = ready["atlas_hash"].string;
    for (const json::Value& section : ready["sections"].items) {
      const std::string& name = section["name"].string;
      Terms::Section& room = name == "summary"     ? terms.summary
                             : name == "points"    ? terms.points
                             : name == "actuators" ? terms.actuators
                                                   : terms.map;
      room = {section["offset"].whole(), section["bytes"].whole(), true};
    }
    terms.ready = ready;
    // Reserved here, so that no answer allocates.
    scratch_.values.reserve(map_len);
    scratch_.points.reserve(terms.points.bytes / 4);
    scratch_.actuators.reserve(terms.actuators.bytes / 4);
    history_.push_back(std::move(terms));
    agreed_ = true;
    return Heard::ready;
  }

  bool read(const std::uint8_t* bytes, std::size_t size, const Header& header, const Terms& terms) {
    const auto floats = [&](const Terms::Section& section, float* to) {
      if (section.offset + section.bytes > size) return false;
      decode_samples(SampleType::f32, bytes + section.offset, section.bytes / 4, 1.0F, to);
      return true;
    };
    Answer& answer = scratch_;
    answer.has_summary = terms.summary.there && terms.summary.bytes == 64;
    answer.points.resize(terms.points.bytes / 4);
    answer.actuators.resize(terms.actuators.bytes / 4);
    if (answer.has_summary && !floats(terms.summary, answer.summary.data())) return false;
    if (!floats(terms.points, answer.points.data())) return false;
    if (!floats(terms.actuators, answer.actuators.data())) return false;
    answer.has_map = terms.map.there;
    if (!answer.has_map) return true;
    const std::size_t count = header.window.pixels();
    if (terms.map.offset + count * sample_bytes(header.sample_type) > size) return false;
    answer.values.resize(count);
    decode_samples(header.sample_type, bytes + terms.map.offset, count, header.scale,
                   answer.values.data());
    return true;
  }

  bool forget(std::uint32_t sequence, Sent& found) {
    for (std::size_t i = 0; i < sent_.size(); ++i) {
      if (sent_[i].sequence != sequence) continue;
      found = sent_[i];
      sent_.erase(sent_.begin() + static_cast<std::ptrdiff_t>(i));
      return true;
    }
    return false;
  }

  void outcome(std::uint32_t sequence, std::uint64_t client_time_us, Status status,
               bool by_client = false) {
    Answer& answer = scratch_;
    answer.sequence = sequence;
    answer.client_time_us = client_time_us;
    answer.status = status;
    answer.by_client = by_client;
    if (status != Status::ok) answer.has_map = answer.has_summary = false;
    if (on_outcome) on_outcome(answer);
  }

  /// A frame that was encoded before the terms changed.
  void recode(Outgoing& frame) {
    std::uint8_t* at = frame.data();
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
