// HTTP requests of the login methods (src/auth) as values: src/net carries them out.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace connect_bridge {

struct HttpAddress {
  bool secure = true;  // https
  std::string host;    // name or address literal, IPv6 without its brackets
  std::uint16_t port = 443;
  std::string target = "/";  // path and query

  // The value of the header "Host".
  [[nodiscard]] std::string authority() const {
    const std::string at = host.find(':') == std::string::npos ? host : "[" + host + "]";
    return port == (secure ? 443 : 80) ? at : at + ":" + std::to_string(port);
  }
  // For logs: without the query, which may hold a secret.
  [[nodiscard]] std::string text() const {
    return (secure ? "https://" : "http://") + authority() + target.substr(0, target.find('?'));
  }
};

struct HttpRequest {
  HttpAddress address;
  std::string json;                         // the body of a POST; empty: a GET
  std::chrono::milliseconds timeout{3000};  // of everything, from the look-up of the name on
  std::size_t answer_bytes_max = 64 << 10;
};

struct HttpAnswer {
  int status = 0;
  std::string body;
  std::optional<std::chrono::seconds> max_age;  // by Cache-Control
  std::string problem;                          // why there is no answer; empty: there is one
};

// Blocks. Any thread, several at once.
using HttpFetch = std::function<HttpAnswer(const HttpRequest&)>;

}  // namespace connect_bridge
