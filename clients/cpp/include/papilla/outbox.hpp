// Frames that have not left: the newest of each finger. A finger's first frame takes memory, no other does.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "touch.hpp"

namespace papilla {

/// What a frame is told from others by.
struct FrameId {
  std::uint32_t sequence = 0;
  std::uint64_t client_time_us = 0;
  std::uint8_t finger = 0;
  std::uint64_t born_us = 0;          ///< when it was handed over, by a steady clock
};

/// The bytes of a frame, with room before them for a transport's own header.
struct Outgoing {
  static constexpr std::size_t headroom = 16;
  std::vector<std::uint8_t> bytes = std::vector<std::uint8_t>(headroom + header_bytes + 4 * (map_len + row_len));
  std::size_t size = 0;               ///< without the headroom
  FrameId id;
  std::uint8_t* data() { return bytes.data() + headroom; }
};

class Outbox {
 public:
  /// The frame of the finger that waits; none: a new one may be written.
  Outgoing* waiting(std::uint8_t finger) {
    Slot& slot = of(finger);
    return slot.waits ? &slot.frame : nullptr;
  }
  /// Where the finger's next frame is to be written; it waits from now on.
  Outgoing& put(std::uint8_t finger) {
    Slot& slot = of(finger);
    slot.waits = true;
    return slot.frame;
  }
  bool any() const {
    for (const Slot& slot : slots_) {
      if (slot.waits) return true;
    }
    return false;
  }
  /// Swaps the next frame that waits with `leaving`; fingers take turns.
  void take(Outgoing& leaving) {
    for (std::size_t i = 0; i < slots_.size(); ++i) {
      turn_ = (turn_ + 1) % slots_.size();
      Slot& slot = slots_[turn_];
      if (!slot.waits) continue;
      slot.waits = false;
      return std::swap(slot.frame, leaving);
    }
  }
  /// Drops every frame that waits and was born by then, and calls `each` with it.
  template <class Each>
  void clear(const Each& each, std::uint64_t born_us = UINT64_MAX) {
    for (Slot& slot : slots_) {
      if (!slot.waits || slot.frame.id.born_us > born_us) continue;
      slot.waits = false;
      each(slot.frame);
    }
  }

 private:
  struct Slot {
    std::uint8_t finger = 0;
    Outgoing frame;
    bool waits = false;
  };
  std::vector<Slot> slots_ = std::vector<Slot>(1);
  std::size_t turn_ = 0;

  Slot& of(std::uint8_t finger) {
    for (Slot& slot : slots_) {
      if (slot.finger == finger) return slot;
    }
    slots_.emplace_back().finger = finger;
    return slots_.back();
  }
};

}  // namespace papilla
