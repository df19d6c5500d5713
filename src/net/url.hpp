// The address of a server, in its parts; src/config reads it.
#pragma once

#include <cstdint>
#include <string>

namespace connect_bridge {

struct Url {
  bool secure = false;      // wss
  std::string host;         // name or address literal, IPv6 without its brackets
  std::uint16_t port = 80;  // 443 for wss
  std::string path = "/";   // with query

  // The value of the HTTP header "Host".
  [[nodiscard]] std::string authority() const;
  // For logs and messages: without the query, which may hold a secret.
  [[nodiscard]] std::string text() const;
};

}  // namespace connect_bridge
