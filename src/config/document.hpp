// What the table says of the parameters: the manual's tables, `--help`, and descriptors of ROS.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/config.hpp"

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

// One per parameter of this role, the given keys of rules included; secrets are left out. The value
// is the given one or the default.
[[nodiscard]] std::vector<ParameterDescriptor> describe_parameters(const Config& config);
// For a key that may be set later ("rule.new.priority"); nullopt: unknown, secret or of the other
// role.
[[nodiscard]] std::optional<ParameterDescriptor> describe_parameter(std::string_view key,
                                                                    Role role);

}  // namespace connect_bridge
