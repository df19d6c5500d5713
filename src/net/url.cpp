#include "net/url.hpp"

#include <algorithm>
#include <charconv>

namespace connect_bridge {
namespace {

std::string lower(std::string_view text) {
  std::string result{text};
  std::transform(result.begin(), result.end(), result.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return result;
}

bool is_host_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-' || c == '.' || c == '_';
}

// "host", "host:port", "[v6]", "[v6]:port" into url. Empty, or what is wrong.
std::string read_authority(std::string_view authority, Url& url) {
  std::string_view port;
  bool has_port = false;
  if (!authority.empty() && authority.front() == '[') {
    const auto end = authority.find(']');
    if (end == std::string_view::npos) return "the ']' of the IPv6 address is missing";
    url.host = lower(authority.substr(1, end - 1));
    const auto allowed = [](char c) {
      return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || c == ':' || c == '.' || c == '%';
    };
    if (url.host.find(':') == std::string::npos ||
        !std::all_of(url.host.begin(), url.host.end(), allowed)) {
      return "'" + url.host + "' is no IPv6 address";
    }
    const std::string_view rest = authority.substr(end + 1);
    if (!rest.empty() && rest.front() != ':') return "after ']' comes ':' and a port, or nothing";
    has_port = !rest.empty();
    if (has_port) port = rest.substr(1);
  } else {
    const auto colon = authority.find(':');
    if (colon != authority.rfind(':')) return "an IPv6 address needs brackets: [::1]";
    has_port = colon != std::string_view::npos;
    url.host = lower(authority.substr(0, colon));
    if (has_port) port = authority.substr(colon + 1);
    if (url.host.empty()) return "the host is missing";
    if (!std::all_of(url.host.begin(), url.host.end(), is_host_character)) {
      return "'" + url.host + "' is no host name";
    }
  }
  if (!has_port) return {};
  const char* const end = port.data() + port.size();
  const auto parsed = std::from_chars(port.data(), end, url.port);
  if (parsed.ec != std::errc{} || parsed.ptr != end || url.port == 0) {
    return "'" + std::string{port} + "' is no port (1 to 65535)";
  }
  return {};
}

}  // namespace

std::string Url::authority() const {
  std::string text = host.find(':') == std::string::npos ? host : "[" + host + "]";
  if (port != (secure ? 443 : 80)) text += ":" + std::to_string(port);
  return text;
}

std::string Url::text() const {
  return (secure ? "wss://" : "ws://") + authority() + path.substr(0, path.find('?'));
}

std::variant<Url, std::string> parse_url(std::string_view text) {
  const auto wrong = [&](const std::string& why) {
    return "'" + std::string{text} + "': " + why + " (expected ws[s]://host[:port][/path])";
  };
  const auto separator = text.find("://");
  if (separator == std::string_view::npos) return wrong("it does not start with ws:// or wss://");
  const std::string scheme = lower(text.substr(0, separator));
  if (scheme != "ws" && scheme != "wss") return wrong("unknown scheme '" + scheme + "'");

  Url url;
  url.secure = scheme == "wss";
  url.port = url.secure ? 443 : 80;
  std::string_view rest = text.substr(separator + 3);
  rest = rest.substr(0, rest.find('#'));
  const auto end = rest.find_first_of("/?");
  const std::string_view authority = rest.substr(0, end);
  if (authority.find('@') != std::string_view::npos) {
    return wrong("user and password do not belong into the URL");
  }
  if (std::string problem = read_authority(authority, url); !problem.empty()) return wrong(problem);

  if (end != std::string_view::npos) {
    url.path = rest.substr(end);
    if (url.path.front() == '?') url.path.insert(0, "/");
  }
  const auto printable = [](char c) { return c > ' ' && c < 0x7f; };
  if (!std::all_of(url.path.begin(), url.path.end(), printable)) {
    return wrong("the path has a character that must be percent-encoded");
  }
  return url;
}

}  // namespace connect_bridge
