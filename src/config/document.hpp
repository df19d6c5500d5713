// Texts about the parameters: the manual's tables and `--help`.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/side/options.hpp"

namespace connect_bridge {

// The table of all parameters as Markdown, a section for each group of them.
[[nodiscard]] std::string config_tables();
// docs/config.md with these tables between its two marks, whatever stands there; nullopt: it has no
// marks.
[[nodiscard]] std::optional<std::string> config_document(std::string_view manual);

// What `--version` prints of every program: version, protocol and build, one line.
[[nodiscard]] std::string version_text();

// `server --help` and `client --help`.
[[nodiscard]] std::string help_text(Role role);

}  // namespace connect_bridge
