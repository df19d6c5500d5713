// Addresses of servers and proxies, in their parts; src/config reads them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace connect_bridge {

// "robot", "[2001:db8::1]"
[[nodiscard]] inline std::string bracketed(const std::string& host) {
  return host.find(':') == std::string::npos ? host : "[" + host + "]";
}

// "robot:9090", "[2001:db8::1]:9090"
[[nodiscard]] inline std::string host_and_port(const std::string& host, std::uint16_t port) {
  return bracketed(host) + ":" + std::to_string(port);
}

// "robot", "[2001:db8::1]": the host of an address, with or without a port (host_and_port()).
[[nodiscard]] inline std::string host_of(const std::string& address) {
  return address.ends_with(']') ? address : address.substr(0, address.rfind(':'));
}

// The name of a robot at its relay (docs/protocol.md, "Relay").
[[nodiscard]] inline bool is_robot_name(std::string_view text) {
  constexpr std::size_t kRobotNameMax = 63;
  return !text.empty() && text.size() <= kRobotNameMax && text.front() != '-' &&
         text.back() != '-' &&
         text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") == std::string_view::npos;
}

struct Url {
  bool secure = false;       // wss or https
  std::string host{};        // name or address literal, IPv6 without brackets, with its zone if any
  std::uint16_t port = 80;   // if secure 443
  std::string target = "/";  // path and query
  std::string robot{};  // the robot that the relay at `host` leads to; empty: `host` is no relay

  // The value of the HTTP header "Host". A zone means something on this machine only (RFC 6874).
  [[nodiscard]] std::string authority() const {
    return authority_of(host.substr(0, host.find('%')));
  }
  // The destination, for people: "robot7@relay.example".
  [[nodiscard]] std::string whom() const {
    return (robot.empty() ? "" : robot + "@") + authority_of(host);
  }
  // The URL for logs and messages: without the query, which may hold a secret. `scheme`: "ws" or
  // "http".
  [[nodiscard]] std::string text(std::string_view scheme) const {
    return std::string{scheme} + (secure ? "s://" : "://") + whom() +
           target.substr(0, target.find('?'));
  }

 private:
  [[nodiscard]] std::string authority_of(const std::string& to) const {
    return port == (secure ? 443 : 80) ? bracketed(to) : host_and_port(to, port);
  }
};

// An HTTP proxy on the route to a server (CONNECT), over plain HTTP.
struct HttpProxy {
  std::string host{};  // name or address literal, IPv6 without its brackets
  std::uint16_t port = 80;
  std::string login{};                         // "user:password", secret; empty: none
  std::string login_key = "http_proxy_login";  // where a person sets the login
  std::string variable{};  // of the environment, that names the proxy; empty: `http_proxy` does
};

}  // namespace connect_bridge
