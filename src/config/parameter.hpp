// Parameters as text, and problems of parameters.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "core/base/parameter.hpp"
#include "core/ports/failure.hpp"

namespace connect_bridge {

// The value as YAML would show it: true, 9090, 0.3, "text", [a, b].
[[nodiscard]] std::string to_text(const ParameterValue& value);

// The cause of a wrong value of this key.
[[nodiscard]] Cause cause_of_key(std::string_view key);

// One mistake of the operator. The value of a secret never appears.
struct Problem {
  // Without a cause: that of the key.
  Problem(std::string of_key, std::string given, std::string wanted, Cause because = Cause::kNone)
      : key(std::move(of_key)),
        value(std::move(given)),
        expected(std::move(wanted)),
        cause(because == Cause::kNone ? cause_of_key(key) : because) {}

  std::string key;
  std::string value;     // as given; empty: the key is missing, or keys contradict each other
  std::string expected;  // what was expected, as a sentence part: "a number from 1 to 65535"
  Cause cause;
};

// "listen.port: 70000 is wrong, expected a whole number from 1 to 65535", for log lines.
[[nodiscard]] std::string to_text(const Problem& problem);
[[nodiscard]] inline Failure failure_of(const Problem& problem) {
  return {problem.cause, to_text(problem)};
}

}  // namespace connect_bridge
