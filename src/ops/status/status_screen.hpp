// The status of a side as lines for a terminal, in the words of the page (status_page.html).
// One unit: its tables and lines share the words, tones and cells above them.
#pragma once

#include <string>

#include "core/base/json.hpp"
#include "ops/status/screen_table.hpp"

namespace connect_bridge {

// `now`: the JSON of docs/status.md; `before`: an earlier one, for rates, or null. The rows with
// the most bytes come first. Nothing but text reaches the terminal, whatever the JSON has in it.
[[nodiscard]] std::string status_screen(const Json& now, const Json& before,
                                        const ScreenSize& size);

}  // namespace connect_bridge
