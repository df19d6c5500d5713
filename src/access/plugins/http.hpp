// HTTP requests of the login methods as values; https.hpp carries them out.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include "core/ports/url.hpp"

namespace connect_bridge {

struct HttpRequest {
  Url url;
  std::string json;                         // the body of a POST; empty: a GET
  std::chrono::milliseconds timeout{3000};  // for everything, from the look-up of the name on
  std::size_t answer_bytes_max = 64 << 10;
};

struct HttpAnswer {
  int status = 0;
  std::string body;
  std::optional<std::chrono::seconds> max_age;  // from Cache-Control
  std::string problem;  // reason why there is no answer; empty: there is one
};

// Makes one request and blocks. Any thread, several at once.
using HttpFetch = std::function<HttpAnswer(const HttpRequest&)>;

}  // namespace connect_bridge
