// HTTP proxies between the client and the server: parses their URLs and chooses the one for a
// server.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/checked_values.hpp"
#include "config/config.hpp"

namespace connect_bridge {

// Parses "http://proxy.example:3128", also with "user:password@" before the host (percent-encoded),
// or without "http://". nullopt: the text is something else.
[[nodiscard]] std::optional<HttpProxy> parse_http_proxy(std::string_view text);

// Whether no_proxy contains this host. The list has names, each with all names below it, addresses,
// or "*"; each entry may end in ":port".
[[nodiscard]] bool is_exempt(std::string_view no_proxy, std::string_view host, std::uint16_t port);

// Checks for the table of keys (see Syntax).
[[nodiscard]] std::optional<std::string> check_http_proxy(std::string_view text);
[[nodiscard]] std::optional<std::string> check_http_proxy_login(std::string_view text);

// The environment's proxy for TLS connections, as other programs choose it: https_proxy or
// HTTPS_PROXY, but not for loopback and hosts in no_proxy or NO_PROXY. `wrong` becomes the name of
// the variable that does not contain a proxy's URL.
[[nodiscard]] std::optional<HttpProxy> environment_proxy(const std::string& host,
                                                         std::uint16_t port,
                                                         const Variable& variable,
                                                         std::string& wrong);

// The proxy of http_proxy and http_proxy_login; by default the environment's, for wss:// only. Adds
// mistakes to `problems`.
[[nodiscard]] std::optional<HttpProxy> read_http_proxy(const CheckedValues& values,
                                                       const Url& server, const Variable& variable,
                                                       std::vector<Problem>& problems);

}  // namespace connect_bridge
