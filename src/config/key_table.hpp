// The table of all parameters. Everything that is said about a parameter comes from here: the check
// at start, the descriptors of `ros2 param describe` and docs/config.md.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/parameter.hpp"
#include "core/side/side.hpp"

namespace connect_bridge {

enum class UsedBy : std::uint8_t { kServer, kClient, kBoth };

// Looks at a string (or at each string of a list); nullopt: fine, else what was expected.
using Syntax = std::optional<std::string> (*)(std::string_view text);

struct KeySpec {
  std::string section{};  // heading in docs/config.md
  std::string key{};      // "listen.port"; keys of a rule are templates: "rule.<name>.priority"
  ParameterType type = ParameterType::kString;
  std::optional<ParameterValue> fallback{};  // the default; none: stays unset
  std::optional<double> min{}, max{};        // numbers: both ends belong to the range
  std::vector<std::string> words{};          // strings: the allowed ones; empty: see `syntax`
  Syntax syntax = nullptr;
  UsedBy used_by = UsedBy::kBoth;
  bool changeable = false;  // at run time
  bool secret = false;      // never shown: no descriptor, no value in any text
  std::string unit{};       // "s", "bytes", "Hz" or empty
  std::string help{};       // one sentence
};

[[nodiscard]] const std::vector<KeySpec>& key_table();

// The row of this key ("rule.drive.priority" finds "rule.<name>.priority"), or nullptr.
[[nodiscard]] const KeySpec* find_key(std::string_view key);

[[nodiscard]] bool is_used_by(const KeySpec& spec, Role role);

// Keys of the ROS layer that are not ours and must not be refused: use_sim_time, qos_overrides.*
// ...
[[nodiscard]] bool is_ros_key(std::string_view key);

// "rule.drive.priority" -> "drive"; empty for other keys.
[[nodiscard]] std::string_view rule_of(std::string_view key);

// The known key that is written most like this one, or empty. A rule's name is kept.
[[nodiscard]] std::string nearest_key(std::string_view key, Role role);

[[nodiscard]] std::string_view type_text(ParameterType type);  // "list of strings"

// "a whole number from 1 to 65535", "one of urgent, high, normal, bulk".
[[nodiscard]] std::string expected_of(const KeySpec& spec);

}  // namespace connect_bridge
