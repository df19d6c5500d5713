#include "config/http_proxy.hpp"

#include <algorithm>
#include <charconv>

#include "config/syntax.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kUrlBytesMax = 2048;

std::string lower(std::string_view text) {
  std::string made{text};
  for (char& c : made)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return made;
}

std::optional<std::string> percent_decoded(std::string_view text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      decoded += text[i];
      continue;
    }
    unsigned value = 0;
    const std::string_view digits = text.substr(i + 1, 2);
    const auto [end, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
    if (error != std::errc{} || digits.size() != 2 || end != digits.data() + 2) return std::nullopt;
    decoded += static_cast<char>(value);
    i += 2;
  }
  return decoded;
}

// A host name of no_proxy without the characters around it, as in "*.example" and "[::1]".
std::string_view bare(std::string_view entry) {
  if (entry.starts_with('*')) entry.remove_prefix(1);
  if (entry.starts_with('.')) entry.remove_prefix(1);
  if (entry.size() > 2 && entry.front() == '[' && entry.back() == ']')
    entry = entry.substr(1, entry.size() - 2);
  return entry;
}

bool covers(std::string_view entry, const std::string& host, std::uint16_t port) {
  if (entry == "*") return true;
  const std::size_t colon = entry.rfind(':');
  const bool has_port = colon != std::string_view::npos &&
                        (std::count(entry.begin(), entry.end(), ':') == 1 || entry[0] == '[') &&
                        entry.back() != ']';
  if (has_port) {
    if (entry.substr(colon + 1) != std::to_string(port)) return false;
    entry = entry.substr(0, colon);
  }
  const std::string name = lower(bare(entry));
  if (name.empty()) return false;
  return host == name || (!syntax::is_ip_address(host) && host.ends_with("." + name));
}

}  // namespace

std::optional<HttpProxy> parse_http_proxy(std::string_view text) {
  if (text.size() > kUrlBytesMax) return std::nullopt;
  const std::size_t scheme = text.find("://");
  if (scheme != std::string_view::npos) {
    if (lower(text.substr(0, scheme)) != "http") return std::nullopt;
    text.remove_prefix(scheme + 3);
  }
  if (text.ends_with('/')) text.remove_suffix(1);
  HttpProxy proxy;
  if (const std::size_t at = text.rfind('@'); at != std::string_view::npos) {
    const auto login = percent_decoded(text.substr(0, at));
    if (!login || check_http_proxy_login(*login)) return std::nullopt;
    proxy.login = *login;
    text.remove_prefix(at + 1);
  }
  const auto reached = syntax::parse_url("ws://" + std::string{text});
  if (!reached || !reached->robot.empty() || reached->target != "/" || text.ends_with('/'))
    return std::nullopt;
  proxy.host = reached->host;
  proxy.port = reached->port;
  return proxy;
}

std::optional<std::string> check_http_proxy(std::string_view text) {
  if (text == "environment" || text == "none") return std::nullopt;
  const auto proxy = parse_http_proxy(text);
  if (proxy && proxy->login.empty()) return std::nullopt;
  return "environment, none, or a URL without user and password, e.g. http://proxy.example:3128";
}

std::optional<std::string> check_http_proxy_login(std::string_view text) {
  const bool fine = text.size() <= 512 && text.find(':') != std::string_view::npos &&
                    std::none_of(text.begin(), text.end(), [](char c) {
                      return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
                    });
  if (fine) return std::nullopt;
  return "\"user:password\", at most 512 bytes";
}

bool is_exempt(std::string_view no_proxy, std::string_view host, std::uint16_t port) {
  const std::string name = lower(host);
  constexpr std::string_view kSeparators = ", \t";
  for (std::size_t begin = 0; begin < no_proxy.size();) {
    const std::size_t end = std::min(no_proxy.find_first_of(kSeparators, begin), no_proxy.size());
    if (end > begin && covers(no_proxy.substr(begin, end - begin), name, port)) return true;
    begin = end + 1;
  }
  return false;
}

std::optional<HttpProxy> environment_proxy(const std::string& host, std::uint16_t port,
                                           const Variable& variable, std::string& wrong) {
  if (!variable || syntax::is_loopback(host)) return std::nullopt;
  const char* const name = variable("https_proxy").empty() ? "HTTPS_PROXY" : "https_proxy";
  const std::string url = variable(name);
  std::string no_proxy = variable("no_proxy");
  if (no_proxy.empty()) no_proxy = variable("NO_PROXY");
  if (url.empty() || is_exempt(no_proxy, host, port)) return std::nullopt;
  auto proxy = parse_http_proxy(url);
  if (!proxy) wrong = name;
  if (proxy) proxy->login_key = proxy->variable = name;
  return proxy;
}

std::optional<HttpProxy> read_http_proxy(const CheckedValues& values, const Url& server,
                                         const Variable& variable, std::vector<Problem>& problems) {
  const std::string given = values.text("http_proxy");
  if (given != "environment" && given != "none") {
    auto proxy = parse_http_proxy(given);
    if (proxy) proxy->login = values.text("http_proxy_login");
    return proxy;
  }
  if (values.given("http_proxy_login"))
    problems.push_back(
        {"http_proxy_login", "", "http_proxy: http://host:port too, else it has no effect"});
  if (given == "none" || !server.secure) return std::nullopt;
  std::string wrong;
  auto proxy = environment_proxy(server.host, server.port, variable, wrong);
  if (!wrong.empty())
    problems.push_back({"http_proxy", "",
                        "http://host:port in the environment variable " + wrong +
                            "; or http_proxy: none, if the server is reached without a proxy"});
  return proxy;
}

}  // namespace connect_bridge
