// Syntax of the texts among the parameters: addresses, URLs, compressions, remappings.
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

inline constexpr auto kNamedByWords = std::to_array<Word<NamedBy>>({
    {NamedBy::kXForwardedFor, "x_forwarded_for"},
    {NamedBy::kProxyProtocol, "proxy_protocol"},
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

// Whether the text is an IPv4 or IPv6 address, without brackets and zone.
[[nodiscard]] bool is_ip_address(std::string_view text);
// Whether the host is "localhost", in 127.0.0.0/8, or ::1. Other spellings of loopback count as
// public, which is the safe choice.
[[nodiscard]] bool is_loopback(std::string_view host);
// The addresses in listen.address, which commas separate.
[[nodiscard]] std::vector<std::string> listen_addresses(std::string_view text);
// Whether all addresses in listen.address are loopback.
[[nodiscard]] bool listens_on_loopback(std::string_view text);
// Parses "wss://..." or "ws://..."; with "robot7@" before the host of a relay.
[[nodiscard]] std::optional<Url> parse_url(std::string_view text);
// Parses "127.0.0.1:9091", "[::1]:9091", "localhost:9091".
[[nodiscard]] std::optional<Url> parse_status_address(std::string_view text);
// Parses "https://..."; for loopback also "http://...".
[[nodiscard]] std::optional<Url> parse_http_url(std::string_view text);
// Parses "auto", "none", "lz4", "zstd", or "zstd:6" with a level from 1 to 19.
[[nodiscard]] std::optional<Compression> parse_compression(std::string_view text);
// Parses "wire:=local", two absolute names.
[[nodiscard]] std::optional<NameMap::Pair> parse_remap(std::string_view text);
// Parses "identity:=word": the word stands before the identity's names (core/policy/names.hpp).
[[nodiscard]] std::optional<std::pair<std::string, std::string>> parse_identity_name(
    std::string_view text);
// Value of `prefix`: each identity has its own prefix.
inline constexpr std::string_view kByIdentity = "by_identity";
// The valid patterns among these texts; other texts are left out.
[[nodiscard]] std::vector<Pattern> parse_patterns(const std::vector<std::string>& texts);
// Converts an operator's seconds to the nearest nanosecond.
[[nodiscard]] Duration from_seconds(double seconds);

// The URL without parts that may be secret: user, password, query.
[[nodiscard]] std::string url_to_show(std::string_view url);

// Checks for the table of keys (see Syntax). nullopt: valid, else the expected form.
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
