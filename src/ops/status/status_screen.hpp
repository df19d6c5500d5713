// The status of a side as lines for a terminal, in the words of the page (run/status_page.html).
#pragma once

#include <cstddef>
#include <string>

#include "core/base/json.hpp"

namespace connect_bridge {

// `now`: the JSON of docs/status.md; `before`: an earlier one, for rates, or null. `rows`: lines of
// topics and calls together; more are counted, and those with the most bytes come first. It is text
// whatever stands in the JSON.
[[nodiscard]] std::string status_screen(const Json& now, const Json& before, std::size_t rows);

}  // namespace connect_bridge
