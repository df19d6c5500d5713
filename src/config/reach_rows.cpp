#include "config/reach_rows.hpp"

#include <string>
#include <utility>

#include "config/http_proxy.hpp"
#include "config/syntax.hpp"

namespace connect_bridge {
namespace {

using namespace syntax;  // NOLINT: a table reads better without the repeated word
using Strings = std::vector<std::string>;
using Rows = std::vector<KeySpec>;

constexpr char kReachSection[] = "Who is reached where";

void add_listen(Rows& rows) {
  const auto add_row = section_adder(rows, kReachSection);
  const auto add = [&](KeySpec spec) {
    spec.used_by = UsedBy::kServer;
    add_row(std::move(spec));
  };
  add({.key = "listen.address",
       .fallback = "127.0.0.1",
       .syntax = check_listen_address,
       .help = "IP address to listen on, or several with commas; `*`: every one; `systemd`: the "
               "sockets that it passes. Beyond loopback a login and TLS are required."});
  add({.key = "listen.port",
       .fallback = std::int64_t{9090},
       .range = NumberRange{0, 65535},
       .help = "TCP port to listen on, at all addresses; 0 takes a free one and logs it."});
  add({.key = "listen.path",
       .fallback = "/",
       .syntax = check_path,
       .help = "Path of the URL under which the bridge answers."});
  add({.key = "listen.trusted_proxies",
       .fallback = Strings{},
       .syntax = check_address_range,
       .help = "Addresses, or ranges as 10.0.0.0/8, of reverse proxies that are trusted to give "
               "the client's address: limits and logs then go by that. Beyond loopback and without "
               "TLS nobody else may connect, unless allow_plaintext."});
  add({.key = "listen.proxy_header",
       .fallback = "x_forwarded_for",
       .words = {"x_forwarded_for", "forwarded", "proxy_protocol"},
       .help = "How they give it: by X-Forwarded-For, by Forwarded (RFC 7239), or by the PROXY "
               "protocol (1 or 2), with which each of their connections must then begin."});
}

}  // namespace

void add_reach_rows(Rows& rows) {
  add_listen(rows);
  const auto add = section_adder(rows, kReachSection);
  add({.key = "url",
       .syntax = check_url,
       .used_by = UsedBy::kClient,
       .help = "The server to dial, wss:// or ws://. Required."});
  add({.key = "http_proxy",
       .fallback = "environment",
       .syntax = check_http_proxy,
       .used_by = UsedBy::kClient,
       .help = "HTTP proxy that the client dials through (CONNECT), "
               "http://proxy.example:3128. `environment`: that of https_proxy, for "
               "wss:// and a server that is not in no_proxy. `none`: no proxy."});
  add({.key = "http_proxy_login",
       .syntax = check_http_proxy_login,
       .used_by = UsedBy::kClient,
       .secret = true,
       .help = "\"user:password\" for the proxy in http_proxy. It goes there "
               "unencrypted, as with all such proxies."});
  add({.key = "allow_plaintext",
       .fallback = false,
       .help = "Permits ws:// beyond loopback: everybody on the way can read and change "
               "everything, the token included."});
}

}  // namespace connect_bridge
