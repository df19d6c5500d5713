// Texts made from the table of parameters: the manual's tables, `--help`, and descriptors of ROS.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/config.hpp"

namespace connect_bridge {

// The table of all parameters as Markdown, a section for each group of them.
[[nodiscard]] std::string config_tables();
// docs/config.md with these tables in place of the text between its two marks; nullopt: `manual`
// has no marks.
[[nodiscard]] std::optional<std::string> config_document(std::string_view manual);

// Output of `--version` of every program, one line: version, protocol and build.
[[nodiscard]] std::string version_text();

// Output of `server --help` and `client --help`.
[[nodiscard]] std::string help_text(Role role);

// Descriptors of this role's parameters, one each, with the given keys of rules; without secrets.
// The value is the given one or the default.
[[nodiscard]] std::vector<ParameterDescriptor> describe_parameters(const Config& config);
// Descriptor of a key that may be set later ("rule.new.priority"); nullopt: the key is unknown,
// secret or of the other role.
[[nodiscard]] std::optional<ParameterDescriptor> describe_parameter(std::string_view key,
                                                                    Role role);

}  // namespace connect_bridge
