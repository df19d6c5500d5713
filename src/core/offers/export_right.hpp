// Whether the peer of a link may have what this side exports, and takes it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/graph/side_view.hpp"
#include "core/link/link.hpp"
#include "core/policy/policy.hpp"

namespace connect_bridge {

// A topic or a service here.
struct LocalInterface {
  InterfaceKind kind;                       // kTopic or kService
  std::pair<std::string, std::string> key;  // local name, type
};

// What the rules here and the peer's `accepts` say.
struct ExportRight {
  enum class Answer : std::uint8_t {
    kYes,
    kUnknown,      // the rules here allow it, and the peer has not said what it accepts
    kNotAccepted,  // the rules here allow it, and the peer does not
    kForbidden,    // no rule here allows it
    kNotWhole,     // a part of its action does not exist
  };
  Answer answer = Answer::kForbidden;
  Decision decision;  // of the rules here, where they allow it

  [[nodiscard]] bool is_allowed_here() const { return answer <= Answer::kNotAccepted; }
};

// The rights of exports are decided here. Two others ask rules or `accepts` themselves: the peer's
// wish for /clock (ClockPublisher), and the search for why a name is missing (MissingNames).
[[nodiscard]] ExportRight export_right(const SideView& side, const Link& link,
                                       const LocalInterface& what);
// As above, for any interface, also one that is not here.
[[nodiscard]] ExportRight export_right(const SideView& side, const Link& link,
                                       const Interface& what);
// Whether it is what the peer calls /parameter_events: each origin has a right of its own.
[[nodiscard]] bool are_parameter_events(const Link& link, const LocalInterface& what);
// Whether the peer gets the events of a node's parameters (local name), which are origins of
// /parameter_events.
[[nodiscard]] bool may_have_events(const SideView& side, const Link& link, std::string_view node);

}  // namespace connect_bridge
