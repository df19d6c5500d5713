// A request for the status, and the refusals that do not depend on its sender.
#pragma once

#include <openssl/ssl.h>

#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <string>

#include "net/websocket/websocket.hpp"

namespace connect_bridge {

using StatusGet = http::request<http::empty_body>;

struct StatusRefusal {
  unsigned status = 0;  // 0: none
  std::string text;
};

// The reason to refuse a request, from any sender: its method, its host or a body. A web page from
// elsewhere may not request anything, not even under a name that leads here. `tls`: null without
// TLS.
[[nodiscard]] StatusRefusal wrong_with(const StatusGet& request, SSL* tls);

}  // namespace connect_bridge
