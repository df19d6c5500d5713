// One HTTP request and its answer, for login methods that use an external service.
#pragma once

#include <optional>
#include <string>

#include "core/ports/http.hpp"
#include "net/options.hpp"

namespace connect_bridge {

// Verifies the server's certificate and name; `ca_file`: PEM, authorities to trust; empty: the
// system's. `proxy`: the way there. Follows no redirects. Blocks until there is an answer or the
// timeout (a hanging name look-up may take longer). Any thread, several at once. Throws nothing.
[[nodiscard]] HttpAnswer fetch(const HttpRequest& request, const std::string& ca_file,
                               const std::optional<HttpProxy>& proxy);

}  // namespace connect_bridge
