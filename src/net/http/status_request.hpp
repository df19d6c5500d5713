// A request for the status, as it came.
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

// What is wrong with the request, whoever sent it: its method, its host (a web page of elsewhere
// may not ask, also not by a name that leads here), a body. `tls`: null without TLS.
[[nodiscard]] StatusRefusal wrong_with(const StatusGet& request, SSL* tls);

}  // namespace connect_bridge
