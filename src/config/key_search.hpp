// Searches the table of keys: exact and nearest rows, and the values that they expect.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/key_table.hpp"

namespace connect_bridge {

// The row of this key ("rule.drive.priority" finds "rule.<name>.priority"), or nullptr.
[[nodiscard]] const KeySpec* find_key(std::string_view key);

// The key of a row; a rule's key gets the rule's name: "rule.drive.priority".
[[nodiscard]] std::string key_of(const KeySpec& spec, std::string_view rule);

// Prefixes of arguments with secret keys on a command line: "auth.token:=".
[[nodiscard]] const std::vector<std::string>& secret_arguments();

// Whether programs of this role have the parameter.
[[nodiscard]] bool is_used_by(const KeySpec& spec, Role role);

inline constexpr std::string_view kUseSimTime = "use_sim_time";
// Whether the ROS layer uses this key, so that it must not be refused: use_sim_time,
// qos_overrides.* ...
[[nodiscard]] bool is_ros_key(std::string_view key);

// The rule's name in a key: "rule.drive.priority" -> "drive"; empty for other keys.
[[nodiscard]] std::string_view rule_of(std::string_view key);

// The most similar known key, or empty. A rule's name is kept. The key may be of the other role: a
// client's file with a misspelt `url` is taken for a server's.
[[nodiscard]] std::string nearest_key(std::string_view key, Role role);

// Number of characters to insert, delete or replace (Levenshtein).
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);

// The word that is most similar to a misspelt one, or empty.
[[nodiscard]] std::string nearest_of(const std::vector<std::string>& words, std::string_view given);

[[nodiscard]] std::string_view type_text(ParameterType type);  // "list of strings"

// The value without parts of a URL that may be secret: user, password, query. Does not handle
// secret keys.
[[nodiscard]] ParameterValue value_to_show(const KeySpec& spec, const ParameterValue& value);

// The value in use: the given one, or the default; nullopt: it stays unset. `key` contains the
// rule's name if it is a rule's.
[[nodiscard]] std::optional<ParameterValue> value_in(const ParameterMap& given, const KeySpec& spec,
                                                     std::string_view key);

// The expected value: "a whole number from 1 to 65535", "one of urgent, high, normal, bulk".
[[nodiscard]] std::string expected_of(const KeySpec& spec);

}  // namespace connect_bridge
