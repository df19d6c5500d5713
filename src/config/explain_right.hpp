// Explains why rules allow an interface or not, for `ctl explain`.
#pragma once

#include <optional>
#include <string>

#include "config/config.hpp"
#include "core/video/picture.hpp"

namespace connect_bridge {

// An interface as a person names it, by the kind of rule key that opens it.
struct RightQuestion {
  OpenedBy what = OpenedBy::kTopics;   // not kNothing
  std::string name;                    // on the wire, as in rules; kParameters: the node's name
  std::string type;                    // empty: any type
  std::optional<Direction> direction;  // none: both
  Identity who;                        // of the peer's login
  bool video = video::available();     // the build makes video of pictures
};

// The answer for all requested directions.
struct RightAnswer {
  std::string text;
  bool allowed = false;  // in every requested direction, at least for some types
};

// Explains the verdict of Policy::decide(), in several lines for each direction: the rule and key
// that allow the interface, other rules that match, patterns that deny it, and the key that the
// peer's side needs.
[[nodiscard]] RightAnswer explain_right(const Config& config, const RightQuestion& question);
// The expected form, as a part of a sentence, if the name or the type is wrong; empty: both are
// fine.
[[nodiscard]] std::string problem_of(const RightQuestion& question);

}  // namespace connect_bridge
