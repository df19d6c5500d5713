// One HTTP request and its answer, for login methods that use an external service.
#pragma once

#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "access/plugins/http.hpp"
#include "core/ports/net_options.hpp"
#include "net/tls/tls_files.hpp"

namespace connect_bridge {

// Makes the requests of one side. Verifies the server's certificate and name; `ca_file`: PEM, whom
// to trust; empty: the system's authorities; read again when it has changed. `proxy`: asked for the
// way there. Follows no redirects.
class Https {
 public:
  Https(const std::string& ca_file, std::optional<HttpProxy> proxy);

  // Blocks until there is an answer or the time is over (a look-up of a name that hangs may take
  // longer). Any thread, several at once. Throws nothing.
  [[nodiscard]] HttpAnswer fetch(const HttpRequest& request);

 private:
  // Null with `problem` set: the file and what is wrong with it.
  TlsContext tls(std::string& problem);

  std::mutex mutex_;  // of `files_`
  TlsFiles files_;
  const std::optional<HttpProxy> proxy_;
};

// For requests to this address, by the proxy that the environment has for it. Adds what is wrong
// with the environment's to `problems`.
[[nodiscard]] HttpFetch https_fetch(const Url& address, const std::string& ca_file,
                                    std::vector<std::string>& problems);

}  // namespace connect_bridge
