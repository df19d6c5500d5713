// One HTTP request and its answer, for login methods that ask others.
#pragma once

#include <optional>
#include <string>

#include "core/ports/http.hpp"
#include "net/options.hpp"

namespace connect_bridge {

// Verifies the server's certificate and name; `ca_file`: PEM, whom to trust; empty: the system's
// authorities. `proxy`: asked for the way there. Follows no redirects. Blocks until there is an
// answer or the time is over (a look-up of a name that hangs may take longer). Any thread, several
// at once. Throws nothing.
[[nodiscard]] HttpAnswer fetch(const HttpRequest& request, const std::string& ca_file,
                               const std::optional<HttpProxy>& proxy);

}  // namespace connect_bridge
