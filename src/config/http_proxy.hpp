// HTTP proxies on the way to the server: how they are written, and which one a URL needs.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/checked_values.hpp"
#include "config/config.hpp"

namespace connect_bridge {

// "http://proxy.example:3128", also with "user:password@" before the host (percent-encoded), or
// without "http://". nullopt: something else.
[[nodiscard]] std::optional<HttpProxy> parse_http_proxy(std::string_view text);

// Whether no_proxy has this host: a list of names, each with all below it, addresses, or "*"; each
// may end in ":port".
[[nodiscard]] bool is_exempt(std::string_view no_proxy, std::string_view host, std::uint16_t port);

// For the table (see Syntax).
[[nodiscard]] std::optional<std::string> check_http_proxy(std::string_view text);
[[nodiscard]] std::optional<std::string> check_http_proxy_login(std::string_view text);

// The environment's proxy for TLS connections, as in other programs: https_proxy or HTTPS_PROXY,
// but not for loopback and hosts in no_proxy or NO_PROXY. `wrong`: the variable that does not
// contain a proxy's URL.
[[nodiscard]] std::optional<HttpProxy> environment_proxy(const std::string& host,
                                                         std::uint16_t port,
                                                         const Variable& variable,
                                                         std::string& wrong);

// The proxy of http_proxy and http_proxy_login; by default that of the environment, for wss://.
// Adds what is wrong to `problems`.
[[nodiscard]] std::optional<HttpProxy> read_http_proxy(const CheckedValues& values,
                                                       const Url& server, const Variable& variable,
                                                       std::vector<Problem>& problems);

}  // namespace connect_bridge
