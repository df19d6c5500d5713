// Parameters as text, and problems of parameters.
#pragma once

#include <string>

#include "core/base/parameter.hpp"

namespace connect_bridge {

// The value as YAML would show it: true, 9090, 0.3, "text", [a, b].
[[nodiscard]] std::string to_text(const ParameterValue& value);

// One mistake of the operator. The value of a secret never appears.
struct Problem {
  std::string key;
  std::string value;     // as given; empty: the key is missing, or keys contradict each other
  std::string expected;  // what was expected, as a sentence part: "a number from 1 to 65535"
};

// "listen.port: 70000 is wrong, expected a whole number from 1 to 65535", for log lines.
[[nodiscard]] std::string to_text(const Problem& problem);

}  // namespace connect_bridge
