// Joins the pieces in which a transport hands over a message (Unreal: 64 KiB each).
#pragma once

#include <cstdint>
#include <vector>

namespace papilla {

class Pieces {
 public:
  /// Appends a piece; true with the last one: `message` is whole until the next piece comes.
  /// Beyond 1 MiB, which no message of the service has, everything is dropped up to the last piece.
  bool add(const void* data, std::size_t size, bool last) {
    if (whole_) message_.clear(), whole_ = false;
    if (too_long_ || size > message_max - message_.size()) {
      too_long_ = !last;
      message_.clear();
      return false;
    }
    const auto* const bytes = static_cast<const std::uint8_t*>(data);
    message_.insert(message_.end(), bytes, bytes + size);
    return whole_ = last;
  }
  const std::vector<std::uint8_t>& message() const { return message_; }
  /// The connection broke: what has come of a message is void.
  void reset() { message_.clear(), whole_ = too_long_ = false; }

 private:
  static constexpr std::size_t message_max = 1U << 20;
  std::vector<std::uint8_t> message_;
  bool whole_ = false, too_long_ = false;
};

}  // namespace papilla
