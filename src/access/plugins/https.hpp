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

// Makes the requests of one side. Verifies the server's certificate and name. `ca_file` has the
// trusted authorities (PEM) and is read again when it has changed; empty: those of the system.
// `proxy`: the HTTP proxy to connect through. Follows no redirects.
class Https {
 public:
  Https(const std::string& ca_file, std::optional<HttpProxy> proxy);

  // Blocks until there is an answer or the request's timeout is over (a look-up of a name that
  // hangs may take longer). Any thread, several at once. Throws nothing.
  [[nodiscard]] HttpAnswer fetch(const HttpRequest& request);

 private:
  // The context; null with `problem` set: the file and its mistake.
  TlsContext tls(std::string& problem);

  std::mutex mutex_;  // protects `files_`
  TlsFiles files_;
  const std::optional<HttpProxy> proxy_;
};

// Makes requests to this address, through the environment's proxy for it. Adds mistakes in the
// environment to `problems`.
[[nodiscard]] HttpFetch https_fetch(const Url& address, const std::string& ca_file,
                                    std::vector<std::string>& problems);

}  // namespace connect_bridge
