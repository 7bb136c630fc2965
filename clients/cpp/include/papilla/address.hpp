// Addresses of a service, as every client takes them (docs/reference/clients/README.md), and its token. Knows no socket.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace papilla::net {

namespace detail {

inline bool only(std::string_view text, std::string_view more) {
  for (const char c : text) {
    const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    if (!plain && more.find(c) == more.npos) return false;
  }
  return true;
}

/// Without blanks and line ends around it.
inline std::string_view stripped(std::string_view text) {
  const char* const blanks = " \t\r\n\f\v";
  const std::size_t begin = text.find_first_not_of(blanks);
  return begin == text.npos ? std::string_view() : text.substr(begin, text.find_last_not_of(blanks) - begin + 1);
}

}  // namespace detail

/// Where a service is: its host, its port, whether by TLS, and the path in front of its own.
struct Address {
  std::string host;
  std::string port = "7224";
  std::string path;
  bool secure = false;
  std::string fault;                  ///< why it is none; empty: it is one

  /// Reads `host`, `host:port` or a URL of http, https, ws or wss.
  static Address of(std::string_view text) {
    Address address;
    const char* const why = address.read(detail::stripped(text));
    if (why) {
      address.fault = "'" + std::string(text) + "' is no address of a papilla-server: " + why +
                      "; write host, host:port, [IPv6]:port or http(s)://host:port/path";
    }
    return address;
  }

  /// Host and port as a `Host` header has them.
  std::string text() const {
    const std::string bare = host.find(':') == std::string::npos ? host : "[" + host + "]";
    return port == (secure ? "443" : "80") ? bare : bare + ":" + port;
  }
  /// URL of one of the service's paths.
  std::string http(std::string_view of = {}) const { return url("http", of); }
  /// URL of sessions.
  std::string session() const { return url("ws", "/v1/session"); }

 private:
  std::string url(const char* scheme, std::string_view of) const {
    return scheme + std::string(secure ? "s" : "") + "://" + text() + path + std::string(of);
  }

  /// Why it is no address; null: it is one.
  const char* read(std::string_view rest) {
    if (rest.empty()) return "it is empty";
    if (!detail::only(rest, "!#$%&'()*+,-./:;=?@[]_~")) return "it holds a blank or another character that no address has";
    if (const std::size_t at = rest.find("://"); at != rest.npos) {
      std::string scheme(rest.substr(0, at));
      for (char& c : scheme) c = c >= 'A' && c <= 'Z' ? char(c + 32) : c;
      secure = scheme == "https" || scheme == "wss";
      if (!secure && scheme != "http" && scheme != "ws") return "its scheme is none of http, https, ws, wss";
      port = secure ? "443" : "80";
      rest.remove_prefix(at + 3);
    }
    if (rest.find_first_of("?#") != rest.npos) return "nothing can follow a '?' or '#'; a token is an argument of its own";
    const std::string_view authority = rest.substr(0, rest.find('/'));
    path = rest.substr(authority.size());
    while (!path.empty() && path.back() == '/') path.pop_back();
    if (authority.find('@') != authority.npos) return "it holds a user or a password; a token is an argument of its own";
    const char* const why = split(authority);
    return why ? why : number();
  }

  const char* split(std::string_view authority) {
    std::size_t end = authority.find(':');
    if (!authority.empty() && authority.front() == '[') {
      const std::size_t bracket = authority.find(']');
      host = authority.substr(1, bracket == authority.npos ? 0 : bracket - 1);
      end = bracket == authority.npos ? bracket : bracket + 1;
      const bool goes_on = end < authority.size() && authority[end] != ':';
      if (goes_on || !is_ipv6(host)) return "in brackets stands an IPv6 address, as [::1]:7224";
    } else {
      host = authority.substr(0, end);
      if (end != authority.npos && authority.find(':', end + 1) != authority.npos) {
        return "an IPv6 address stands in brackets, as [::1]:7224";
      }
      if (host.empty() || !detail::only(host, "._-")) return "its host is missing or has a character that no host has";
    }
    if (end < authority.size()) port = authority.substr(end + 1);
    return nullptr;
  }

  static bool is_ipv6(std::string_view text) {
    std::size_t colons = 0;
    for (const char c : text) colons += c == ':';
    return colons > 1 && text.find_first_not_of("0123456789abcdefABCDEF:.") == text.npos;
  }

  /// The port, without zeros before it.
  const char* number() {
    unsigned long value = 0;
    bool good = !port.empty() && port.size() < 6;
    for (const char c : port) {
      good = good && c >= '0' && c <= '9';
      value = 10 * value + static_cast<unsigned long>(good ? c - '0' : 0);
    }
    if (!good || value < 1 || value > 65535) return "its port is no number from 1 to 65535";
    port = std::to_string(value);
    return nullptr;
  }
};

/// Takes blanks and line ends away from around a token, as files have them; false for others inside.
inline bool clean_token(std::string& token) {
  token = std::string(detail::stripped(token));
  for (const char c : token) {
    if (c < '!' || c > '~') return false;
  }
  return true;
}

}  // namespace papilla::net
