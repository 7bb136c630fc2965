// One map over HTTP, and the atlas. One request a connection; not for the frames of a loop.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "core.hpp"
#include "net.hpp"

namespace papilla {

/// An answer over HTTP; status 0: none came, `problem` says why.
struct HttpAnswer {
  int status = 0;
  std::string head;
  std::string body;
  Problem problem;

  /// Value of a header, by its name in lower case; empty if it is not there.
  std::string header(const std::string& name) const {
    const std::size_t at = head.find("\r\n" + name + ": ");
    if (at == std::string::npos) return {};
    const std::size_t begin = at + name.size() + 4;
    return head.substr(begin, head.find("\r\n", begin) - begin);
  }
};

/// Sends a request to the service at an address (`net::Address`); `path` is one of its own.
inline HttpAnswer http(const std::string& url, const std::string& method, const std::string& path,
                       const std::string& body = {}, const std::string& headers = {}) {
  HttpAnswer answer;
  const auto failed = [&](const std::string& why) {
    answer.problem = {"", url + ": " + why, ""};
    return answer;
  };
  const net::Address address = net::Address::of(url);
  if (!address.fault.empty()) return answer.problem = {"bad_address", address.fault, ""}, answer;
  net::Socket socket;
  if (address.secure) return failed("TLS: put a proxy in front, or use another client");
  if (!socket.open(address)) return failed("nobody listens; is papilla-server running there?");
  // As long as a request may wait for models that are being loaded.
  socket.patience(30);
  const std::string request = method + " " + address.path + path + " HTTP/1.1\r\nHost: " + address.text() +
                              "\r\nConnection: close\r\nContent-Length: " +
                              std::to_string(body.size()) + "\r\n" + headers + "\r\n" + body;
  if (!socket.send(request.data(), request.size())) return failed("the connection broke");
  std::string all;
  char piece[65536];
  std::size_t due = std::string::npos, split = std::string::npos;
  while (all.size() < due) {
    const std::size_t got = socket.receive(piece, sizeof piece);
    if (got == 0) break;
    all.append(piece, got);
    if (split == std::string::npos && (split = all.find("\r\n\r\n")) != std::string::npos) {
      answer.head = all.substr(0, split + 2);
      for (char& c : answer.head) c = c >= 'A' && c <= 'Z' ? char(c + 32) : c;
      const std::string length = answer.header("content-length");
      if (!length.empty()) due = split + 4 + std::strtoul(length.c_str(), nullptr, 10);
    }
  }
  if (split == std::string::npos || (due != std::string::npos && all.size() < due)) {
    return failed(all.empty() ? "no answer; is papilla-server running there?" : "the answer broke off");
  }
  answer.body = all.substr(split + 4);
  answer.status = std::atoi(all.c_str() + std::min<std::size_t>(all.find(' ') + 1, all.size()));
  if (answer.status >= 400) {
    json::Value value;
    json::parse(answer.body, value);
    const json::Value& error = value["error"];
    answer.problem = {error["code"].string, error["message"].string, error["field"].string};
  }
  return answer;
}

/// SED (J/m3) of one pressure map (Pa), both 224 x 224, row by row. Empty if refused: `answer`,
/// if given, says why, and otherwise which tier rendered (`x-papilla-tier`). `finger` by name, or the
/// default one.
inline std::vector<float> sed(const std::vector<float>& pressure_pa, const std::string& url = "127.0.0.1:7224",
                              const std::string& tier = {}, HttpAnswer* answer = nullptr,
                              const std::string& finger = {}) {
  std::string body(4 * pressure_pa.size(), '\0');
  encode_samples(SampleType::f32, pressure_pa.data(), pressure_pa.size(), 1.0F,
                 reinterpret_cast<std::uint8_t*>(&body[0]));
  std::string path = "/v1/sed";
  if (!tier.empty()) path += "?tier=" + tier;
  if (!finger.empty()) {
    path += tier.empty() ? "?finger=" : "&finger=";
    // What is no name of a finger is refused, and stays one parameter.
    for (const unsigned char byte : finger) {
      const char* digits = "0123456789abcdef";
      path += {'%', digits[byte >> 4], digits[byte & 15]};
    }
  }
  HttpAnswer got = http(url, "POST", path, body,
                        "Content-Type: application/octet-stream\r\nAccept: application/octet-stream\r\n");
  std::vector<float> map;
  if (got.status == 200 && got.body.size() == 4 * map_len) {
    map.resize(map_len);
    decode_samples(SampleType::f32, reinterpret_cast<const std::uint8_t*>(got.body.data()), map_len, 1.0F,
                   map.data());
  }
  if (answer) *answer = std::move(got);
  return map;
}

}  // namespace papilla
