// A session over a socket of its own: two threads, latest wins, reconnects by itself.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core.hpp"
#include "hello.hpp"
#include "websocket.hpp"

namespace papilla {

class Session {
 public:
  struct Options {
    std::string url = "127.0.0.1:7224";  ///< host, host:port or a URL; see net::Address
    std::string token;                ///< bearer token, if the service asks for one; blanks around it go
    /// What to ask for.
    Hello hello;
    /// Called with every outcome, from the session's threads or from `send`, under its lock: copy
    /// what is needed and return.
    std::function<void(const Answer&)> on_answer;
    /// Called with what people should know, each thing once: the first refused frame, the first one out of range, the
    /// first timeout, what the service asks of the hello, a budget that it cannot meet. By default it prints.
    std::function<void(const std::string&)> warn = [](const std::string& words) {
      std::fprintf(stderr, "papilla: %s\n", words.c_str());
    };
    int retry_ms = 150;
    /// A frame without an answer for so long is lost, whether it waits for a connection or for the service; in the
    /// second case the connection is given up and another opened. Set the actuators to zero then.
    int timeout_ms = 5000;
  };

  Session() : Session(Options()) {}
  explicit Session(Options options)
      : options_(std::move(options)), address_(net::Address::of(options_.url)), core_(Core::following(options_.hello.members())) {
    core_.on_answer = [this](const Answer& answer) { outcome(answer); };
    core_.on_warning = options_.warn;
  }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session() { close(); }

  /// Connects and says hello; false: `problem()` says why not.
  bool open() {
    if (!address_.fault.empty()) return problem_ = {"bad_address", address_.fault, ""}, false;
    if (!net::clean_token(options_.token)) return problem_ = bad_token(), false;
    if (!Core::is_readable(options_.hello.members(), problem_) || !connect()) return false;
    reader_ = std::thread([this] { live(); });
    writer_ = std::thread([this] { write(); });
    watcher_ = std::thread([this] { watch(); });
    return true;
  }

  /// Ends the session; frames without an outcome are lost.
  void close() {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (closed_) return;
      closed_ = true;
      socket_->shut();
    }
    changed_.notify_all();
    ends_.notify_all();
    if (watcher_.joinable()) watcher_.join();
    if (reader_.joinable()) reader_.join();
    if (writer_.joinable()) writer_.join();
    if (mover_.joinable()) mover_.join();
    std::lock_guard<std::mutex> lock(mutex_);
    core_.end();
    socket_->close();
  }

  /// Hands over one frame, the whole map (224 x 224, Pa, row by row) or the samples of a window,
  /// and returns its sequence at once. Replaces one that has not left. Allocates nothing.
  std::uint32_t send(const float* pressure_pa, Window window = {}, std::uint64_t client_time_us = now_us(),
                     std::uint32_t deadline_us = 0) {
    return hand_over([&] { return core_.send(pressure_pa, window, client_time_us, deadline_us); });
  }

  /// Hands over where the objects of the hello are in a finger's frame, as `send` does a map.
  std::uint32_t send_poses(const Pose* poses, std::size_t count, std::uint8_t finger = 0,
                           const NetForce* net = nullptr, std::uint64_t client_time_us = now_us()) {
    return hand_over([&] { return core_.send_poses(poses, count, client_time_us, finger, net); });
  }

  /// Hands over how deep the undeformed skin lies in things, mm, negative in air.
  std::uint32_t send_gaps(const float* depth_mm, std::size_t count, std::uint8_t finger = 0,
                          const NetForce* net = nullptr, std::uint64_t client_time_us = now_us()) {
    return hand_over([&] { return core_.send_gaps(depth_mm, count, client_time_us, finger, net); });
  }

  /// Hands over that tracking of the finger is lost. Better than an old pose, or one of zeros: the answer is zero, no
  /// unit fires, and nothing bursts when tracking comes back.
  std::uint32_t send_not_tracked(std::uint8_t finger = 0, std::uint64_t client_time_us = now_us()) {
    return hand_over([&] { return core_.send_not_tracked(client_time_us, finger); });
  }

  /// The finger's newest answer with status ok, once; false if none came since. Swaps, so that
  /// nothing is copied: `mine` is what a game loop calls this with every frame.
  bool latest(Answer& mine, std::uint8_t finger = 0) {
    std::lock_guard<std::mutex> lock(mutex_);
    if (finger >= fingers_max || !latest_[finger].fresh) return false;
    latest_[finger].fresh = false;
    std::swap(mine, latest_[finger].answer);
    return true;
  }

  /// `send`, and waits for the outcome, at most so long; status lost if it does not come.
  const Answer& render(const float* pressure_pa, Window window = {}, std::uint64_t client_time_us = now_us(),
                       std::uint32_t deadline_us = 0, int timeout_ms = 30000) {
    return await([&] { return core_.send(pressure_pa, window, client_time_us, deadline_us); }, timeout_ms);
  }

  /// `send_poses`, and waits for the outcome; its `touch` holds the force.
  const Answer& touch(const std::vector<Pose>& poses, std::uint8_t finger = 0, const NetForce* net = nullptr,
                      int timeout_ms = 30000) {
    return await([&] { return core_.send_poses(poses.data(), poses.size(), now_us(), finger, net); }, timeout_ms);
  }

  /// `send_not_tracked`, and waits for the outcome.
  const Answer& not_tracked(std::uint8_t finger = 0, int timeout_ms = 30000) {
    return await([&] { return core_.send_not_tracked(now_us(), finger); }, timeout_ms);
  }

  /// `send_gaps`, and waits for the outcome.
  const Answer& touch_gaps(const std::vector<float>& depth_mm, std::uint8_t finger = 0,
                           const NetForce* net = nullptr, int timeout_ms = 30000) {
    return await([&] { return core_.send_gaps(depth_mm.data(), depth_mm.size(), now_us(), finger, net); },
                 timeout_ms);
  }

  /// Says hello again in the open session; false: `problem()` says why not, and the old terms stand.
  bool renew(const Hello& hello, int timeout_ms = 30000) {
    std::unique_lock<std::mutex> lock(mutex_);
    if (!core_.is_ready()) return problem_ = {"", "there is no session just now", ""}, false;
    if (!Core::is_readable(hello.members(), problem_)) return false;
    const std::string members = Core::following(hello.members());
    new_hello_ = Core::hello_text(members);
    is_answered_ = is_granted_ = false;
    changed_.notify_all();
    const auto wait = std::chrono::milliseconds(timeout_ms);
    const bool good = changed_.wait_for(lock, wait, [this] { return is_answered_ || closed_; }) && is_granted_;
    is_answered_ = true;  // also after a timeout: frames go on under the old terms
    if (good) core_.set_hello(members);
    return good;
  }

  /// What the service agreed to.
  Ready ready() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return core_.ready();
  }
  bool connected() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return core_.is_ready();
  }
  /// Times that a session was opened: more than 1 after a reconnect.
  std::uint64_t connections() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return connections_;
  }
  std::uint64_t superseded_by_client() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return core_.superseded_by_client();
  }
  /// What people were told so far, each thing once.
  std::vector<std::string> warnings() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return core_.warnings();
  }
  /// `Options::timeout_ms` from now on.
  void set_timeout_ms(int timeout_ms) {
    std::lock_guard<std::mutex> lock(mutex_);
    options_.timeout_ms = timeout_ms;
  }
  /// Why the last `open` or `renew` failed.
  Problem problem() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return problem_;
  }

 private:
  static constexpr std::size_t fingers_max = 10;
  struct Latest {
    Answer answer;
    bool fresh = false;
  };

  Options options_;
  net::Address address_;
  mutable std::mutex mutex_;
  std::condition_variable changed_, ends_;
  Core core_;
  std::unique_ptr<WebSocket> socket_ = std::make_unique<WebSocket>(), next_;
  std::thread reader_, writer_, mover_, watcher_;
  std::vector<std::uint8_t> message_;
  bool closed_ = false;
  bool sending_ = false;              ///< the writer has the socket
  Problem problem_;
  std::uint64_t connections_ = 0;
  std::array<Latest, fingers_max> latest_;
  Answer rendered_;
  bool wants_ = false;
  std::uint32_t wanted_ = 0;
  std::string new_hello_, pong_;
  bool is_answered_ = true, is_granted_ = false, pong_due_ = false;
  enum class Moving { no, dialling, seal_due, held, failed };
  /// Longest wait for what the service remembers, and for the ready that follows.
  static constexpr int seal_patience_s = 5;
  Moving moving_ = Moving::no;

  template <class Send>
  std::uint32_t hand_over(const Send& send) {
    std::uint32_t sequence;
    {
      std::lock_guard<std::mutex> lock(mutex_);
      sequence = send();
    }
    changed_.notify_all();
    return sequence;
  }

  template <class Send>
  const Answer& await(const Send& send, int timeout_ms) {
    std::unique_lock<std::mutex> lock(mutex_);
    wanted_ = send();
    wants_ = true;
    rendered_.status = Status::lost;
    rendered_.forget_values();
    rendered_.forget_head();
    changed_.notify_all();
    changed_.wait_for(lock, std::chrono::milliseconds(timeout_ms), [this] { return !wants_ || closed_; });
    wants_ = false;
    return rendered_;
  }

  void outcome(const Answer& answer) {
    if (options_.on_answer) options_.on_answer(answer);
    if (answer.status == Status::ok) {
      Latest& latest = latest_[std::min<std::size_t>(answer.finger, fingers_max - 1)];
      latest.answer = answer;         // keeps its room: no allocation
      latest.fresh = true;
    }
    if (wants_ && answer.sequence == wanted_) {
      rendered_ = answer;
      wants_ = false;
      changed_.notify_all();
    }
  }

  static Problem bad_token() {
    return {"bad_token", "the token holds a blank, a line end or a character that no token has", "token"};
  }

  bool connect() {
    std::string error, answer;
    if (!socket_->open(address_, "/v1/session", options_.token, error, answer)) {
      json::Value value;
      json::parse(answer, value);
      const json::Value& said = value["error"];
      std::lock_guard<std::mutex> lock(mutex_);
      problem_ = said.is_null() ? Problem{"", error, ""}
                                : Problem{said["code"].string, said["message"].string, said["field"].string};
      if (problem_.code == "unauthorized") problem_.message += "; here in Options::token";
      return false;
    }
    socket_->patience(30);
    if (!socket_->send_text(core_.hello())) return false;
    const auto kind = socket_->receive(message_);
    std::lock_guard<std::mutex> lock(mutex_);
    const auto event = kind == WebSocket::Message::text ? core_.text(text()) : Core::Event::broken;
    if (event != Core::Event::ready) {
      problem_ = event == Core::Event::refused ? core_.refusal() : Problem{"", "no ready came", ""};
      return false;
    }
    socket_->patience(0);
    ++connections_;
    return true;
  }

  std::string_view text() const {
    return {reinterpret_cast<const char*>(message_.data()), message_.size()};
  }

  /// Reads until the connection breaks, and opens another.
  void live() {
    for (;;) {
      read();
      std::unique_lock<std::mutex> lock(mutex_);
      core_.lost();
      is_answered_ = true, is_granted_ = false, pong_due_ = false;
      moving_ = Moving::no;
      socket_->shut();
      changed_.notify_all();
      changed_.wait(lock, [this] { return !sending_; });
      const auto pause = std::chrono::milliseconds(options_.retry_ms);
      do {
        if (changed_.wait_for(lock, pause, [this] { return closed_; })) return;
        lock.unlock();
        const bool good = connect();
        lock.lock();
        if (closed_) socket_->shut();
        if (good) break;
      } while (!closed_);
      changed_.notify_all();
      if (closed_) return;
    }
  }

  void read() {
    for (;;) {
      const auto kind = socket_->receive(message_);
      if (kind == WebSocket::Message::closed) return;
      std::unique_lock<std::mutex> lock(mutex_);
      if (kind == WebSocket::Message::ping) {
        pong_ = socket_->ping();
        pong_due_ = true;
        changed_.notify_all();
        continue;
      }
      if (kind == WebSocket::Message::binary && Core::is_sealed(message_.data(), message_.size())) {
        if (core_.is_last_seal() && moving_ == Moving::held) move(lock);
        continue;
      }
      const auto event = kind == WebSocket::Message::text
                             ? core_.text(text())
                             : core_.binary(message_.data(), message_.size());
      if (event == Core::Event::broken) return;
      if (event == Core::Event::refused && moving_ == Moving::held) {
        // In place of the seal: nothing else is asked for meanwhile.
        if (core_.is_last_seal()) stay(core_.refusal().message);
        continue;
      }
      if (event == Core::Event::reconnect) {
        if (moving_ == Moving::no) dial(lock);
        continue;
      }
      if (core_.waiting()) changed_.notify_all();
      if (event == Core::Event::nothing || is_answered_) continue;
      is_answered_ = true;
      is_granted_ = event == Core::Event::ready;
      if (!is_granted_) problem_ = core_.refusal();
      changed_.notify_all();
    }
  }

  /// Opens another connection while this one goes on, until the session has moved to it or ends.
  void dial(std::unique_lock<std::mutex>& lock) {
    moving_ = Moving::dialling;
    lock.unlock();
    if (mover_.joinable()) mover_.join();
    mover_ = std::thread([this] {
      for (;;) {
        auto next = std::make_unique<WebSocket>();
        std::string error, answer;
        const bool good = next->open(address_, "/v1/session", options_.token, error, answer);
        std::unique_lock<std::mutex> held(mutex_);
        if (closed_ || moving_ == Moving::no) return;
        if (good) {
          next_ = std::move(next);
          moving_ = Moving::seal_due;
          changed_.notify_all();
          const auto over = [this] { return closed_ || moving_ == Moving::no || moving_ == Moving::failed; };
          const bool ended = changed_.wait_for(held, std::chrono::seconds(seal_patience_s), over);
          next_.reset();
          if (!ended) stay("nothing came within " + std::to_string(seal_patience_s) + " s");
          if (closed_ || moving_ == Moving::no) return;
        }
        // The old connection goes on for as long as it is there.
        moving_ = Moving::dialling;
        changed_.notify_all();
        const auto ends = [this] { return closed_ || moving_ == Moving::no; };
        if (changed_.wait_for(held, std::chrono::milliseconds(options_.retry_ms), ends)) return;
      }
    });
  }

  /// Goes on over the old connection, which nobody asks for its seal again unless the service asks to move again.
  void stay(const std::string& why) {
    core_.stay(why);
    moving_ = Moving::no;
    changed_.notify_all();
  }

  /// Goes on over the other connection with what the service remembers; frames wait meanwhile.
  void move(std::unique_lock<std::mutex>& lock) {
    std::unique_ptr<WebSocket> next = std::move(next_);
    const std::string hello = core_.resuming();
    lock.unlock();
    std::vector<std::uint8_t> sealed(WebSocket::headroom + message_.size());
    std::copy(message_.begin(), message_.end(), sealed.begin() + WebSocket::headroom);
    bool good = next != nullptr;
    if (good) {
      next->patience(5);
      good = next->send_text(hello) &&
             next->send(true, sealed.data() + WebSocket::headroom, message_.size()) &&
             next->receive(message_) == WebSocket::Message::text;
    }
    lock.lock();
    changed_.wait(lock, [this] { return !sending_; });
    good = good && !closed_ && moving_ == Moving::held && core_.text(text()) == Core::Event::ready;
    if (good) {
      next->patience(0);
      std::swap(socket_, next);
      next->send_close();
      ++connections_;
    }
    if (moving_ == Moving::held) moving_ = good ? Moving::no : Moving::failed;
    changed_.notify_all();
  }

  /// Ends frames whose time is over. A thread of its own: the others may be waiting for the socket.
  void watch() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (!closed_) {
      const int timeout_ms = options_.timeout_ms;
      ends_.wait_for(lock, std::chrono::milliseconds(std::clamp(timeout_ms / 20, 5, 100)), [this] { return closed_; });
      if (!closed_ && core_.expire(std::uint64_t(std::max(1, timeout_ms)) * 1000)) socket_->shut();
    }
  }

  /// Sends what waits, one message at a time; a frame not while new terms are being agreed on.
  void write() {
    std::unique_lock<std::mutex> lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] {
        const bool held = moving_ == Moving::held;
        const bool frame = core_.can_take() && is_answered_;
        const bool seal = moving_ == Moving::seal_due && is_answered_;
        return closed_ ||
               (core_.is_ready() && (pong_due_ || (!held && (seal || frame || !new_hello_.empty()))));
      });
      if (closed_) return;
      std::string hello, pong;
      const bool answers = std::exchange(pong_due_, false);
      if (answers) pong = pong_;
      if (!answers && new_hello_.empty() && moving_ == Moving::seal_due && is_answered_) {
        moving_ = Moving::held;
        hello = core_.ask_for_seal();
      } else if (!answers) {
        hello.swap(new_hello_);
      }
      Outgoing* frame = !answers && hello.empty() ? core_.take() : nullptr;
      sending_ = true;
      lock.unlock();
      bool good = true;
      if (answers) good = socket_->send_pong(pong);
      if (!hello.empty()) good = socket_->send_text(hello);
      if (frame) good = socket_->send(true, frame->data(), frame->size);
      lock.lock();
      sending_ = false;
      if (!good) socket_->shut();
      changed_.notify_all();
    }
  }
};

}  // namespace papilla
