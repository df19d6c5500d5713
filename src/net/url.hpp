// The address of a server, as an operator writes it: ws[s]://host[:port][/path].
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

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
  bool operator==(const Url&) const = default;
};

// The URL, or a sentence that says what is wrong with it.
[[nodiscard]] std::variant<Url, std::string> parse_url(std::string_view text);

}  // namespace connect_bridge
