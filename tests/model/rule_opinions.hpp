// One question to the rules, and what they and the second opinion on them (sim/rights.hpp) say.
#pragma once

#include <cstdint>
#include <string>

#include "sim/rights.hpp"

namespace connect_bridge::model {

struct Asked {
  InterfaceKind kind = InterfaceKind::kTopic;
  std::string name, type, action_type;
  [[nodiscard]] Interface what() const { return {kind, name, type, action_type}; }
};

// The rule that allows it, by the number in `treatment.calls_max`: the treatment is all that the
// second opinion tells. 0: none.
struct RuleOpinions {
  std::uint32_t by = 0;
  std::uint32_t by_second = 0;
  bool told = true;  // a peer that knows only `accepts` comes to the same
  [[nodiscard]] bool agree() const { return by == by_second && told; }
};

// `accepts` is policy.accepts(who).
RuleOpinions opinions_of(const Policy& policy, const Accepts& accepts, Direction direction,
                         const Asked& asked, const Identity& who);
// With all that was asked.
std::string to_text(const RuleOpinions& opinions, const Policy& policy, Direction direction,
                    const Asked& asked, const Identity& who);

}  // namespace connect_bridge::model
