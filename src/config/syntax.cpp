#include "config/syntax.hpp"

#include <arpa/inet.h>
#include <net/if.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "core/wire/login.hpp"
#include "core/wire/text.hpp"

namespace connect_bridge::syntax {
namespace {

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}
bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

template <class Allowed>
bool consists_of(std::string_view text, Allowed allowed) {
  return !text.empty() && std::all_of(text.begin(), text.end(), allowed);
}

std::optional<unsigned> number(std::string_view text, std::size_t digits_max, unsigned max) {
  unsigned value = 0;
  if (text.empty() || text.size() > digits_max) return std::nullopt;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value > max) return std::nullopt;
  return value;
}

// The bytes of an address in network order. Leading zeros, which some programs read as octal, and
// zones are invalid.
std::optional<Bytes> parse_ip(int family, std::string_view text) {
  Bytes bytes(family == AF_INET ? 4 : 16);
  const bool ends_early = text.find('\0') != std::string_view::npos;
  if (ends_early || inet_pton(family, std::string{text}.c_str(), bytes.data()) != 1)
    return std::nullopt;
  return bytes;
}

// "fe80::1", without a zone.
bool is_link_local(std::string_view text) {
  const auto address = parse_ip(AF_INET6, text);
  return address && (*address)[0] == 0xfe && ((*address)[1] & 0xc0) == 0x80;
}

// "fe80::1%eth0": a link-local address exists once on each interface (RFC 4007 section 11).
bool is_zoned_ip(std::string_view text) {
  const std::size_t at = text.find('%');
  if (at == std::string_view::npos) return false;
  const std::string_view zone = text.substr(at + 1);
  return is_link_local(text.substr(0, at)) && zone.size() < IF_NAMESIZE &&
         consists_of(zone, [](char c) {
           return is_letter(c) || is_digit(c) || c == '-' || c == '.' || c == '_';
         });
}

bool is_host_name(std::string_view text) {
  return text.size() <= 253 && text.front() != '.' && text.front() != '-' &&
         consists_of(text, [](char c) {
           return is_letter(c) || is_digit(c) || c == '-' || c == '.' || c == '_';
         });
}

// Whether all characters need no escaping and cannot break a request line.
bool is_target(std::string_view text) {
  return !text.empty() && text.front() == '/' && std::all_of(text.begin(), text.end(), [](char c) {
    return c > ' ' && c < 0x7f && c != '#' && c != '"' && c != '<' && c != '>' && c != '\\';
  });
}

// Reads "host", "host:port" or "[ipv6]:port". An IPv6 address may have a zone, after "%25" as RFC
// 6874 writes it in URLs, or after "%" as people write it.
bool read_authority(std::string_view text, Url& url) {
  std::string_view port;
  if (!text.empty() && text.front() == '[') {
    const std::size_t end = text.find(']');
    if (end == std::string_view::npos) return false;
    url.host = text.substr(1, end - 1);
    port = text.substr(end + 1);
    if (const auto escaped = url.host.find("%25"); escaped != std::string::npos)
      url.host.erase(escaped + 1, 2);
    if (!parse_ip(AF_INET6, url.host) && !is_zoned_ip(url.host)) return false;
  } else {
    const std::size_t colon = text.find(':');
    url.host = text.substr(0, colon);
    if (colon != std::string_view::npos) port = text.substr(colon);
    if (url.host.empty() || !is_host_name(url.host)) return false;
  }
  url.port = url.secure ? 443 : 80;
  if (port.empty()) return true;
  const auto value = number(port.substr(1), 5, 65535);
  if (port.front() != ':' || !value || *value == 0) return false;
  url.port = static_cast<std::uint16_t>(*value);
  return true;
}

Complaint expect(bool fine, const char* expected) {
  return fine ? Complaint{} : Complaint{expected};
}

}  // namespace

bool is_ip_address(std::string_view text) {
  return parse_ip(AF_INET, text) || parse_ip(AF_INET6, text);
}

bool is_loopback(std::string_view host) {
  if (host == "localhost") return true;
  if (const auto ipv4 = parse_ip(AF_INET, host))
    return ipv4->front() == 127;  // mutant: loopback_127
  Bytes loopback(16, 0);
  loopback.back() = 1;
  return parse_ip(AF_INET6, host) == loopback;
}

std::optional<Url> parse_url(std::string_view text) {
  Url url;
  std::string scheme{text.substr(0, std::min(text.find("://"), text.size()))};
  for (char& c : scheme) c = (c >= 'A' && c <= 'Z') ? static_cast<char>(c - 'A' + 'a') : c;
  if ((scheme != "ws" && scheme != "wss") || scheme.size() + 3 > text.size()) return std::nullopt;
  url.secure = scheme == "wss";
  const std::string_view rest = text.substr(scheme.size() + 3);
  const std::size_t slash = rest.find('/');
  std::string_view authority = rest.substr(0, slash);
  if (const std::size_t at = authority.find('@'); at != std::string_view::npos) {
    url.robot = authority.substr(0, at);
    if (!is_robot_name(url.robot)) return std::nullopt;
    authority.remove_prefix(at + 1);
  }
  if (!read_authority(authority, url)) return std::nullopt;
  url.target = slash == std::string_view::npos ? "/" : rest.substr(slash);
  if (!is_target(url.target)) return std::nullopt;
  return url;
}

std::optional<Url> parse_status_address(std::string_view text) {
  auto url = parse_url("ws://" + std::string{text});
  const bool whole = url && url->robot.empty() && host_and_port(url->host, url->port) == text &&
                     (url->host == "localhost" || is_ip_address(url->host));
  return whole ? url : std::nullopt;
}

std::optional<Url> parse_http_url(std::string_view text) {
  constexpr std::string_view kHttp = "http";
  if (!text.starts_with(kHttp)) return std::nullopt;
  auto url = parse_url("ws" + std::string{text.substr(kHttp.size())});
  if (url && (!url->robot.empty() || (!url->secure && !is_loopback(url->host))))
    return std::nullopt;
  return url;
}

std::string url_to_show(std::string_view url) {
  const std::size_t scheme = url.find("://");
  const std::size_t from = scheme == std::string_view::npos ? 0 : scheme + 3;
  const std::size_t slash = url.find('/', from);
  std::string authority{url.substr(from, slash == std::string_view::npos ? slash : slash - from)};
  if (const auto at = authority.rfind('@'); at != std::string::npos) {
    authority.replace(0, at, "...");  // mutant: url_password
  }
  std::string rest{slash == std::string_view::npos ? std::string_view{} : url.substr(slash)};
  std::string shown = std::string{url.substr(0, from)} + authority + rest;
  if (const auto query = shown.find('?'); query != std::string::npos) {
    shown.replace(query, std::string::npos, "?...");
  }
  return shown;
}

std::optional<Compression> parse_compression(std::string_view text) {
  if (text == "auto") return Compression{.automatic = true};
  if (text == "none") return Compression{};
  if (text == "lz4") return Compression{.codec = Codec::kLz4};
  if (text == "zstd") return Compression{.codec = Codec::kZstd};
  if (text.substr(0, 5) != "zstd:") return std::nullopt;
  const auto level = number(text.substr(5), 2, 19);
  if (!level || *level == 0) return std::nullopt;
  return Compression{.codec = Codec::kZstd, .level = static_cast<int>(*level)};
}

std::optional<NameMap::Pair> parse_remap(std::string_view text) {
  const std::size_t at = text.find(":=");
  if (at == std::string_view::npos) return std::nullopt;
  NameMap::Pair pair{std::string{text.substr(0, at)}, std::string{text.substr(at + 2)}};
  if (!is_canonical_name(pair.wire) || !is_canonical_name(pair.local)) return std::nullopt;
  return pair;
}

std::optional<std::pair<std::string, std::string>> parse_identity_name(std::string_view text) {
  const std::size_t at = text.rfind(":=");
  if (at == std::string_view::npos || at == 0 || !is_prefix_word(text.substr(at + 2)))
    return std::nullopt;
  return std::pair{std::string{text.substr(0, at)}, std::string{text.substr(at + 2)}};
}

std::vector<Pattern> parse_patterns(const std::vector<std::string>& texts) {
  std::vector<Pattern> parsed;
  for (const std::string& text : texts) {
    if (auto pattern = Pattern::parse(text)) parsed.push_back(std::move(pattern).value());
  }
  return parsed;
}

Duration from_seconds(double seconds) {
  return Duration{static_cast<Duration::rep>(std::llround(seconds * 1e9))};
}

std::vector<std::string> listen_addresses(std::string_view text) {
  std::vector<std::string> addresses;
  for (std::size_t begin = 0, end = 0; begin <= text.size(); begin = end + 1) {
    end = std::min(text.find(',', begin), text.size());
    std::string_view part = text.substr(begin, end - begin);
    while (part.starts_with(' ')) part.remove_prefix(1);
    while (part.ends_with(' ')) part.remove_suffix(1);
    addresses.emplace_back(part);
  }
  return addresses;
}

bool listens_on_loopback(std::string_view text) {
  const auto addresses = listen_addresses(text);
  return std::all_of(addresses.begin(), addresses.end(),
                     [](const std::string& address) { return is_loopback(address); });
}

Complaint check_listen_address(std::string_view text) {
  constexpr std::size_t kAddressesMax = 8;
  const auto addresses = listen_addresses(text);
  const bool several = addresses.size() <= kAddressesMax &&
                       std::all_of(addresses.begin(), addresses.end(), [](const auto& address) {
                         return is_ip_address(address) || is_zoned_ip(address);
                       });
  return expect(text == "*" || text == "systemd" || several,
                "an IP address, e.g. 127.0.0.1, 0.0.0.0 or ::, up to 8 of them with commas, * for "
                "every address, or systemd for its sockets");
}

Complaint check_status_address(std::string_view text) {
  return expect(parse_status_address(text).has_value(),
                "an IP address and a port, e.g. 127.0.0.1:9091 or [::1]:9091");
}

Complaint check_address_range(std::string_view text) {
  const std::size_t slash = text.find('/');
  const std::string_view address = text.substr(0, slash);
  const unsigned bits_max = parse_ip(AF_INET, address) ? 32 : 128;
  const auto bits =
      slash == std::string_view::npos ? bits_max : number(text.substr(slash + 1), 3, bits_max);
  // 0 bits would make every address a proxy.
  return expect(is_ip_address(address) && bits && *bits > 0,
                "an IP address or a range of them, e.g. 127.0.0.1 or 10.0.0.0/8");
}

Complaint check_url(std::string_view text) {
  const auto url = parse_url(text);
  if (url && is_link_local(url->host))
    return "an address with its interface, since fe80:: exists on each of them (ip addr shows "
           "them), e.g. wss://[fe80::1%eth0]:9090/";
  if (text.find('@') != std::string_view::npos && !url) {
    return "a URL without user and password (a token belongs in auth.token_file), or with the name "
           "of a robot at a relay: a to z, 0 to 9 and -, as in wss://robot7@relay.example/";
  }
  return expect(url.has_value(),
                "a URL that begins with wss:// (or ws://), e.g. wss://robot.example/");
}

Complaint check_relay_url(std::string_view text) {
  const auto url = parse_url(text);
  return expect(url && url->secure && !url->robot.empty() && url->target == "/",
                "this robot's name and the relay, e.g. wss://robot7@relay.example/; the name of "
                "a to z, 0 to 9 and -");
}

Complaint check_http_url(std::string_view text) {
  return expect(parse_http_url(text).has_value(),
                "a URL that begins with https:// (http:// on this machine only), without user and "
                "password");
}

Complaint check_file_or_http_url(std::string_view text) {
  return text.find("://") == std::string_view::npos ? check_not_empty(text) : check_http_url(text);
}

Complaint check_compression(std::string_view text) {
  return expect(parse_compression(text).has_value(),
                "auto, none, lz4, zstd, or zstd with a level from 1 to 19, e.g. zstd:6");
}

Complaint check_remap(std::string_view text) {
  return expect(parse_remap(text).has_value(),
                "two absolute names \"wire:=local\", e.g. /scan:=/robot1/laser");
}

Complaint check_prefix(std::string_view text) {
  return expect(text.empty() || text == kByIdentity || is_canonical_name(text),
                "an absolute name without a '/' at its end, e.g. /robot1, by_identity, or an empty "
                "text");
}

Complaint check_identity_name(std::string_view text) {
  return expect(parse_identity_name(text).has_value(),
                "\"identity:=name\", the name of letters, digits and '_', e.g. robot-7:=robot7");
}

Complaint check_pattern(std::string_view text) {
  const auto pattern = Pattern::parse(text);
  if (pattern) return std::nullopt;
  // The error contains the text and then the expected form; the Problem contains the text already.
  constexpr std::string_view kExpected = "expected ";
  const std::string& message = pattern.error().message;
  const std::size_t at = message.rfind(kExpected);
  return at == std::string::npos ? message : message.substr(at + kExpected.size());
}

Complaint check_type(std::string_view text) {
  return expect(is_type_name(text), "the full name of a type, e.g. geometry_msgs/msg/Twist");
}

Complaint check_rule_name(std::string_view text) {
  return expect(consists_of(text, [](char c) { return is_letter(c) || is_digit(c) || c == '_'; }),
                "a name of letters, digits and '_'");
}

Complaint check_word(std::string_view text) {
  return expect(
      consists_of(text, [](char c) { return (c >= 'a' && c <= 'z') || is_digit(c) || c == '_'; }),
      "a word of lower-case letters, digits and '_', e.g. bbr");
}

Complaint check_not_empty(std::string_view text) {
  return expect(!text.empty(), "a text that is not empty");
}

// A pin is 32 bytes in base64. The last letter before the '=' carries four bits only.
Complaint check_pin(std::string_view text) {
  constexpr std::string_view kLastLetters = "AEIMQUYcgkosw048";
  const bool fine = text.size() == 44 && text[43] == '=' &&
                    kLastLetters.find(text[42]) != std::string_view::npos &&
                    consists_of(text.substr(0, 43), [](char c) {
                      return is_letter(c) || is_digit(c) || c == '+' || c == '/';
                    });
  return expect(fine, "a SHA-256 of a public key in base64: 43 characters and one '='");
}

Complaint check_named_pin(std::string_view text) {
  const std::string_view rest = text.substr(std::min(text.find(' '), text.size()));
  if (auto wrong = check_pin(text.substr(0, text.size() - rest.size())))
    return *wrong + ", alone or with a space, the server's name and its groups behind it";
  return expect(is_text(rest), "a name and groups that can be shown");
}

Complaint check_token(std::string_view text) {
  const bool printable = consists_of(text, [](char c) { return c > ' ' && c < 0x7f; });
  return expect(printable && text.size() <= kCredentialBytesMax,
                "1 to 3900 printable ASCII characters without spaces");
}

}  // namespace connect_bridge::syntax
