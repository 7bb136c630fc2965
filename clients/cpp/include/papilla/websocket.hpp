// A WebSocket client (RFC 6455): text, binary, fragments, ping, close. No extensions.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "net.hpp"

namespace papilla {

namespace detail {

/// SHA-1, for the handshake's proof that the other side speaks WebSocket.
inline std::array<std::uint8_t, 20> sha1(std::string text) {
  const std::uint64_t bits = std::uint64_t{text.size()} * 8;
  text.push_back('\x80');
  while (text.size() % 64 != 56) text.push_back('\0');
  for (int shift = 56; shift >= 0; shift -= 8) text.push_back(static_cast<char>(bits >> shift));
  std::uint32_t h[5] = {0x67452301, 0xefcdab89, 0x98badcfe, 0x10325476, 0xc3d2e1f0};
  const auto turn = [](std::uint32_t x, int n) { return (x << n) | (x >> (32 - n)); };
  for (std::size_t block = 0; block < text.size(); block += 64) {
    std::uint32_t w[80];
    for (int i = 0; i < 16; ++i) {
      w[i] = 0;
      for (int j = 0; j < 4; ++j) {
        w[i] = w[i] << 8 | static_cast<std::uint8_t>(text[block + std::size_t(4 * i + j)]);
      }
    }
    for (int i = 16; i < 80; ++i) w[i] = turn(w[i - 3] ^ w[i - 8] ^ w[i - 14] ^ w[i - 16], 1);
    std::uint32_t a = h[0], b = h[1], c = h[2], d = h[3], e = h[4];
    for (int i = 0; i < 80; ++i) {
      const std::uint32_t f = i < 20   ? ((b & c) | (~b & d)) + 0x5a827999
                              : i < 40 ? (b ^ c ^ d) + 0x6ed9eba1
                              : i < 60 ? ((b & c) | (b & d) | (c & d)) + 0x8f1bbcdc
                                       : (b ^ c ^ d) + 0xca62c1d6;
      const std::uint32_t next = turn(a, 5) + f + e + w[i];
      e = d, d = c, c = turn(b, 30), b = a, a = next;
    }
    h[0] += a, h[1] += b, h[2] += c, h[3] += d, h[4] += e;
  }
  std::array<std::uint8_t, 20> digest{};
  for (std::size_t i = 0; i < 20; ++i) digest[i] = static_cast<std::uint8_t>(h[i / 4] >> (24 - 8 * (i % 4)));
  return digest;
}

inline std::string base64(const std::uint8_t* bytes, std::size_t size) {
  static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < size; i += 3) {
    std::uint32_t group = 0;
    for (std::size_t j = 0; j < 3; ++j) group = group << 8 | (i + j < size ? bytes[i + j] : 0U);
    for (std::size_t j = 0; j < 4; ++j) {
      out.push_back(i + j <= size ? letters[group >> (18 - 6 * j) & 63] : '=');
    }
  }
  return out;
}

}  // namespace detail

class WebSocket {
 public:
  enum class Message { text, binary, ping, closed };

  static constexpr std::size_t headroom = 14;

  /// Connects and shakes hands; `error` says why not. `answer` takes the body of a refusal.
  bool open(const net::Address& address, const std::string& path, const std::string& token,
            std::string& error, std::string& answer) {
    filled_ = read_ = 0;
    if (address.secure) return error = "TLS: put a proxy in front, or use another client", false;
    if (!socket_.open(address)) return error = address.text() + ": nobody listens; is papilla-server running there?", false;
    std::uint8_t nonce[16];
    for (auto& byte : nonce) byte = static_cast<std::uint8_t>(random_());
    const std::string key = detail::base64(nonce, sizeof nonce);
    std::string request = "GET " + address.path + path + " HTTP/1.1\r\nHost: " + address.text() +
                          "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13"
                          "\r\nSec-WebSocket-Key: " + key + "\r\n";
    if (!token.empty()) request += "Authorization: Bearer " + token + "\r\n";
    request += "\r\n";
    socket_.patience(10);
    if (!socket_.send(request.data(), request.size())) return error = "the connection broke", false;
    std::string head;
    while (head.size() < 16384 && head.find("\r\n\r\n") == std::string::npos) {
      std::uint8_t byte;
      if (!fill(&byte, 1)) return error = address.text() + ": no answer; is papilla-server running there?", false;
      head.push_back(static_cast<char>(byte));
    }
    if (head.find(" 101 ") == std::string::npos) {
      for (std::uint8_t byte; answer.size() < 4096 && fill(&byte, 1);) {
        answer.push_back(static_cast<char>(byte));
        if (answer.size() > 1 && answer.back() == '}' && answer[answer.size() - 2] == '}') break;
      }
      return error = head.substr(0, head.find('\r')), false;
    }
    const auto proof = detail::sha1(key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11");
    if (head.find(detail::base64(proof.data(), proof.size())) == std::string::npos) {
      return error = "the other side is no WebSocket", false;
    }
    socket_.patience(0);
    return true;
  }

  /// Sends a message that has `headroom` bytes of room before it. The bytes are masked in place,
  /// as the protocol demands of clients.
  bool send(bool binary, std::uint8_t* bytes, std::size_t size) {
    return send_as(binary ? 0x82 : 0x81, bytes, size);
  }
  bool send_text(std::string_view text) { return send_small(0x81, text); }
  bool send_pong(std::string_view payload) { return send_small(0x8a, payload); }
  bool send_close() { return send_small(0x88, std::string_view("\x03\xe8", 2)); }

  /// The next message, fragments joined. `into` keeps its room.
  Message receive(std::vector<std::uint8_t>& into) {
    Message kind = Message::closed;
    into.clear();
    for (;;) {
      std::uint8_t head[10];
      if (!fill(head, 2)) return Message::closed;
      std::uint64_t size = head[1] & 127;
      const std::size_t more = size == 126 ? 2 : size == 127 ? 8 : 0;
      if (!fill(head + 2, more)) return Message::closed;
      if (more != 0) size = 0;
      for (std::size_t i = 0; i < more; ++i) size = size << 8 | head[2 + i];
      const int code = head[0] & 15;
      // A server masks nothing; its messages are below 1 MiB.
      if ((head[1] & 128) != 0 || (head[0] & 0x70) != 0 || size > message_max) return Message::closed;
      if (code == 9 || code == 10 || code == 8) {
        char payload[125];
        if (size > sizeof payload || !fill(payload, size) || code == 8) return Message::closed;
        if (code == 9) {
          control_.assign(payload, size);
          return Message::ping;
        }
        continue;
      }
      if (code != 0) kind = code == 1 ? Message::text : Message::binary;
      const std::size_t before = into.size();
      if (before + size > message_max) return Message::closed;
      into.resize(before + size);
      if (!fill(into.data() + before, size)) return Message::closed;
      if ((head[0] & 128) != 0) return kind;
    }
  }
  /// Payload of the last ping.
  const std::string& ping() const { return control_; }

  void patience(int seconds) { socket_.patience(seconds); }
  void shut() { socket_.shut(); }
  void close() { socket_.close(); }

 private:
  static constexpr std::uint64_t message_max = 1U << 20;

  net::Socket socket_;
  std::minstd_rand random_{std::random_device{}()};
  std::string control_;
  std::array<std::uint8_t, 65536> buffer_{};
  std::size_t filled_ = 0, read_ = 0;

  bool fill(void* to, std::uint64_t size) {
    auto* at = static_cast<std::uint8_t*>(to);
    while (size != 0) {
      if (read_ == filled_) {
        // Large pieces go past the buffer.
        if (size >= buffer_.size()) {
          const std::size_t got = socket_.receive(at, size);
          if (got == 0) return false;
          at += got, size -= got;
          continue;
        }
        filled_ = socket_.receive(buffer_.data(), buffer_.size());
        read_ = 0;
        if (filled_ == 0) return false;
      }
      const std::size_t part = size < filled_ - read_ ? std::size_t(size) : filled_ - read_;
      std::memcpy(at, buffer_.data() + read_, part);
      at += part, size -= part, read_ += part;
    }
    return true;
  }

  bool send_small(std::uint8_t first, std::string_view payload) {
    std::vector<std::uint8_t> bytes(headroom + payload.size());
    if (!payload.empty()) std::memcpy(bytes.data() + headroom, payload.data(), payload.size());
    return send_as(first, bytes.data() + headroom, payload.size());
  }

  bool send_as(std::uint8_t first, std::uint8_t* bytes, std::size_t size) {
    const std::size_t head = size < 126 ? 6 : size < 65536 ? 8 : 14;
    std::uint8_t* start = bytes - head;
    start[0] = first;
    start[1] = static_cast<std::uint8_t>(128 | (size < 126 ? size : size < 65536 ? 126 : 127));
    for (std::size_t i = 2; i < head - 4; ++i) {
      start[i] = static_cast<std::uint8_t>(std::uint64_t{size} >> (8 * (head - 5 - i)));
    }
    std::uint8_t mask[8];
    for (int i = 0; i < 4; ++i) mask[i] = mask[i + 4] = static_cast<std::uint8_t>(random_());
    std::memcpy(bytes - 4, mask, 4);
    std::uint64_t wide;
    std::memcpy(&wide, mask, sizeof wide);
    std::size_t i = 0;
    for (; i + 8 <= size; i += 8) {
      std::uint64_t word;
      std::memcpy(&word, bytes + i, sizeof word);
      word ^= wide;
      std::memcpy(bytes + i, &word, sizeof word);
    }
    for (; i < size; ++i) bytes[i] ^= mask[i % 4];
    return socket_.send(start, head + size);
  }
};

}  // namespace papilla
