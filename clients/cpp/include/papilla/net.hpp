// TCP on POSIX and Winsock: what a session and a request need of it.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

#include "address.hpp"

#ifdef _WIN32
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <winsock2.h>
#include <ws2tcpip.h>
#else
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cerrno>
#endif

namespace papilla::net {

#ifdef _WIN32
using Handle = SOCKET;
constexpr Handle none = INVALID_SOCKET;
inline void start() {
  static const int started = [] {
    WSADATA data;
    return WSAStartup(MAKEWORD(2, 2), &data);
  }();
  (void)started;
}
#else
using Handle = int;
constexpr Handle none = -1;
inline void start() {}
#endif

class Socket {
 public:
  /// Room of the system for each direction, bytes: more than the largest frame. With less a
  /// sender waits for room in the middle of a frame (docs/concepts/real-time.md).
  static constexpr int room_bytes = 512 * 1024;

  Socket() = default;
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() { close(); }

  bool open(const Address& address) {
    close();
    start();
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* list = nullptr;
    if (getaddrinfo(address.host.c_str(), address.port.c_str(), &hints, &list) != 0) return false;
    for (addrinfo* each = list; each && handle_ == none; each = each->ai_next) {
      const Handle handle = ::socket(each->ai_family, each->ai_socktype, each->ai_protocol);
      if (handle == none) continue;
      const int one = 1;
      // Before connecting: the window's scale is agreed on then.
      set(handle, SOL_SOCKET, SO_SNDBUF, room_bytes);
      set(handle, SOL_SOCKET, SO_RCVBUF, room_bytes);
      set(handle, IPPROTO_TCP, TCP_NODELAY, one);
#ifdef SO_NOSIGPIPE
      set(handle, SOL_SOCKET, SO_NOSIGPIPE, one);
#endif
      if (::connect(handle, each->ai_addr, static_cast<socklen_t>(each->ai_addrlen)) == 0) {
        handle_ = handle;
      } else {
        close(handle);
      }
    }
    freeaddrinfo(list);
    return handle_ != none;
  }

  bool is_open() const { return handle_ != none; }

  bool send(const void* bytes, std::size_t size) {
#ifdef MSG_NOSIGNAL
    constexpr int flags = MSG_NOSIGNAL;
#else
    constexpr int flags = 0;
#endif
    const char* at = static_cast<const char*>(bytes);
    while (size != 0) {
      const auto sent = ::send(handle_, at, portion(size), flags);
      if (sent <= 0) {
        if (sent < 0 && interrupted()) continue;
        return false;
      }
      at += sent;
      size -= static_cast<std::size_t>(sent);
    }
    return true;
  }

  /// Up to `size` bytes; 0: the other side closed or the connection broke.
  std::size_t receive(void* bytes, std::size_t size) {
    for (;;) {
      const auto got = ::recv(handle_, static_cast<char*>(bytes), portion(size), 0);
      if (got < 0 && interrupted()) continue;
      return got > 0 ? static_cast<std::size_t>(got) : 0;
    }
  }

  /// Longest wait of a receive, s; 0: any.
  void patience(int seconds) {
#ifdef _WIN32
    const DWORD wait = static_cast<DWORD>(seconds) * 1000;
#else
    timeval wait{};
    wait.tv_sec = seconds;
#endif
    setsockopt(handle_, SOL_SOCKET, SO_RCVTIMEO, reinterpret_cast<const char*>(&wait), sizeof wait);
  }

  /// Ends both directions and wakes whoever waits; the handle stays until `close`.
  void shut() {
    if (handle_ != none) ::shutdown(handle_, 2);
  }

  void close() {
    const Handle handle = handle_.exchange(none);
    if (handle != none) close(handle);
  }

 private:
  std::atomic<Handle> handle_{none};  // `shut` comes from other threads

  static void set(Handle handle, int level, int name, int value) {
    setsockopt(handle, level, name, reinterpret_cast<const char*>(&value), sizeof value);
  }
#ifdef _WIN32
  static int portion(std::size_t size) { return static_cast<int>(size < (1U << 30) ? size : 1U << 30); }
  static bool interrupted() { return false; }
  static void close(Handle handle) { ::closesocket(handle); }
#else
  static std::size_t portion(std::size_t size) { return size; }
  static bool interrupted() { return errno == EINTR; }
  static void close(Handle handle) { ::close(handle); }
#endif
};

}  // namespace papilla::net
