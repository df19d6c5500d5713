// The rules among the parameters.
#pragma once

#include <string>
#include <vector>

#include "config/checked_values.hpp"
#include "config/parameter.hpp"
#include "core/policy/policy.hpp"
#include "core/ports/net_options.hpp"

namespace connect_bridge {

enum class Moment : std::uint8_t { kStart, kRunning };

struct RuleSet {
  std::vector<Rule> rules;
  bool defaults = false;  // none were given, and this is a client
  Duration clock_publish_period = Duration::zero();
};

// Adds to problems and warnings; the result is valid only if there are no problems.
[[nodiscard]] RuleSet read_rules(const CheckedValues& values, Role role, Moment moment,
                                 std::vector<Problem>& problems,
                                 std::vector<std::string>& warnings);

// That of a client without rules. Everything that the server allows exists there. The server may
// receive the topics of the client's side that its rules import. It may never call services there:
// a client does not trust a server that far.
[[nodiscard]] Rule default_rule();

}  // namespace connect_bridge
