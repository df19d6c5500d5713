// Finding rows of the table of keys: exact, nearest, and what they expect.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/key_table.hpp"

namespace connect_bridge {

// The row of this key ("rule.drive.priority" finds "rule.<name>.priority"), or nullptr.
[[nodiscard]] const KeySpec* find_key(std::string_view key);

// The key of a row; of a rule's key with the rule's name: "rule.drive.priority".
[[nodiscard]] std::string key_of(const KeySpec& spec, std::string_view rule);

// How the secret keys begin on a command line: "auth.token:=".
[[nodiscard]] const std::vector<std::string>& secret_arguments();

[[nodiscard]] bool is_used_by(const KeySpec& spec, Role role);

inline constexpr std::string_view kUseSimTime = "use_sim_time";
// Keys of the ROS layer that are not ours and must not be refused: use_sim_time, qos_overrides.*
// ...
[[nodiscard]] bool is_ros_key(std::string_view key);

// "rule.drive.priority" -> "drive"; empty for other keys.
[[nodiscard]] std::string_view rule_of(std::string_view key);

// The known key that is most similar to this one, or empty. A rule's name is kept. It may be one of
// the other role: a misspelt `url` is why a client's file is taken for a server's.
[[nodiscard]] std::string nearest_key(std::string_view key, Role role);

// Number of characters to insert, delete or replace (Levenshtein).
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);

[[nodiscard]] std::string_view type_text(ParameterType type);  // "list of strings"

// The value without what may be secret in a URL: user, password, query. It does not handle secret
// keys.
[[nodiscard]] ParameterValue value_to_show(const KeySpec& spec, const ParameterValue& value);

// The value in use: the given one, or the default; nullopt: it stays unset. `key` of a rule has the
// rule's name.
[[nodiscard]] std::optional<ParameterValue> value_in(const ParameterMap& given, const KeySpec& spec,
                                                     std::string_view key);

// "a whole number from 1 to 65535", "one of urgent, high, normal, bulk".
[[nodiscard]] std::string expected_of(const KeySpec& spec);

}  // namespace connect_bridge
