// A parameter as ROS gives it, and what is said about one that is wrong.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace connect_bridge {

using ParameterValue =
    std::variant<bool, std::int64_t, double, std::string, std::vector<bool>,
                 std::vector<std::int64_t>, std::vector<double>, std::vector<std::string>>;

// Dotted names ("rule.drive.import_topics") with their values.
using ParameterMap = std::map<std::string, ParameterValue, std::less<>>;

// The value as YAML would show it: true, 9090, 0.3, "text", [a, b].
[[nodiscard]] std::string to_text(const ParameterValue& value);

// One mistake of the operator. The value of a secret never appears.
struct Problem {
  std::string key;
  std::string value;     // as given; empty: the key is missing or the mistake lies between keys
  std::string expected;  // what was expected, as a sentence part: "a number from 1 to 65535"
};

// "listen.port: 70000 is not possible: expected a whole number from 1 to 65535", for log lines.
[[nodiscard]] std::string to_text(const Problem& problem);

}  // namespace connect_bridge
