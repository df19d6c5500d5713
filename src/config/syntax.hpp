// How the texts among the parameters are written: addresses, URLs, compressions, remappings.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/time.hpp"
#include "core/policy/names.hpp"
#include "core/policy/pattern.hpp"
#include "core/policy/policy.hpp"
#include "core/ports/actions.hpp"
#include "core/ports/net_options.hpp"
#include "core/wire/codec.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge::syntax {

inline constexpr auto kToldByWords = std::to_array<Word<ToldBy>>({
    {ToldBy::kXForwardedFor, "x_forwarded_for"},
    {ToldBy::kProxyProtocol, "proxy_protocol"},
});

inline constexpr auto kRoleWords = std::to_array<Word<Role>>({
    {Role::kServer, "server"},
    {Role::kClient, "client"},
});

inline constexpr auto kLogLevelWords = std::to_array<Word<LogLevel>>({
    {LogLevel::kDebug, "debug"},
    {LogLevel::kInfo, "info"},
    {LogLevel::kWarn, "warn"},
    {LogLevel::kError, "error"},
});

[[nodiscard]] bool is_ip_address(std::string_view text);
// "localhost", 127.0.0.0/8 or ::1. Other spellings of loopback count as public, which is the safe
// choice.
[[nodiscard]] bool is_loopback(std::string_view host);
// The parts of listen.address, which commas divide.
[[nodiscard]] std::vector<std::string> listen_addresses(std::string_view text);
// Whether all of them are loopback.
[[nodiscard]] bool listens_on_loopback(std::string_view text);
// "wss://..." or "ws://..."; with "robot7@" before the host of a relay.
[[nodiscard]] std::optional<Url> parse_url(std::string_view text);
// "127.0.0.1:9091", "[::1]:9091", "localhost:9091".
[[nodiscard]] std::optional<Url> parse_status_address(std::string_view text);
// "https://..."; on this machine "http://..." too.
[[nodiscard]] std::optional<Url> parse_http_url(std::string_view text);
[[nodiscard]] std::optional<Compression> parse_compression(std::string_view text);
[[nodiscard]] std::optional<NameMap::Pair> parse_remap(std::string_view text);
// "identity:=word": the word stands before its names (core/policy/names.hpp).
[[nodiscard]] std::optional<std::pair<std::string, std::string>> parse_identity_name(
    std::string_view text);
// In place of a prefix: each identity's own.
inline constexpr std::string_view kByIdentity = "by_identity";
// The patterns among these texts; texts that are no patterns are left out.
[[nodiscard]] std::vector<Pattern> parse_patterns(const std::vector<std::string>& texts);
// Seconds as written by an operator, to the nearest nanosecond.
[[nodiscard]] Duration from_seconds(double seconds);

// The URL without what may be secret in it: user, password, query.
[[nodiscard]] std::string url_to_show(std::string_view url);

// For the table (see Syntax): nullopt is fine, else what was expected.
using Complaint = std::optional<std::string>;
Complaint check_listen_address(std::string_view text);
Complaint check_status_address(std::string_view text);
Complaint check_address_range(std::string_view text);
Complaint check_url(std::string_view text);
Complaint check_relay_url(std::string_view text);
Complaint check_http_url(std::string_view text);
Complaint check_file_or_http_url(std::string_view text);
Complaint check_compression(std::string_view text);
Complaint check_remap(std::string_view text);
Complaint check_prefix(std::string_view text);
Complaint check_identity_name(std::string_view text);
Complaint check_pattern(std::string_view text);
Complaint check_type(std::string_view text);
Complaint check_rule_name(std::string_view text);
Complaint check_word(std::string_view text);  // [a-z0-9_]+
Complaint check_not_empty(std::string_view text);
Complaint check_pin(std::string_view text);
Complaint check_named_pin(std::string_view text);  // an entry as core/ports/pin.hpp reads it
Complaint check_token(std::string_view text);

}  // namespace connect_bridge::syntax
