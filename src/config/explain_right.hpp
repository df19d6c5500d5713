// Why rules allow an interface or not, for `ctl explain`.
#pragma once

#include <optional>
#include <string>

#include "config/config.hpp"

namespace connect_bridge {

// An interface as a person names it: what a rule's key is for.
struct RightQuestion {
  OpenedBy what = OpenedBy::kTopics;   // not kNothing
  std::string name;                    // as rules have it: on the wire; of a node for kParameters
  std::string type;                    // empty: whatever it is
  std::optional<Direction> direction;  // none: both
  Identity who;                        // the identity that the peer logs in as
};

struct RightAnswer {
  std::string text;
  bool allowed = false;  // in each direction that is asked for, for some types at least
};

// Several lines for each direction: whether it is allowed, by which rule and key, which other rules
// matched, what denies it, and what the peer's side needs. The verdict is that of Policy::decide().
[[nodiscard]] RightAnswer explain_right(const Config& config, const RightQuestion& question);
// What is wrong with the name or the type, as a sentence part; empty: nothing.
[[nodiscard]] std::string problem_of(const RightQuestion& question);

}  // namespace connect_bridge
