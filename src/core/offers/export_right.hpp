// Whether the peer of a link may have an export of this side, and takes it.
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

// A topic or a service of the local graph.
struct LocalInterface {
  InterfaceKind kind;                       // kTopic or kService
  std::pair<std::string, std::string> key;  // local name, type
};

// The combined answer of the rules here and the peer's `accepts`.
struct ExportRight {
  enum class Answer : std::uint8_t {
    kYes,
    kUnknown,      // the rules here allow it; the peer's `accepts` has not arrived
    kNotAccepted,  // the rules here allow it; the peer's do not
    kForbidden,    // no rule here allows it
    kNotWhole,     // a part of its action does not exist
  };
  Answer answer = Answer::kForbidden;
  Decision decision;  // of the rules here, if they allow it

  [[nodiscard]] bool is_allowed_here() const { return answer <= Answer::kNotAccepted; }
};

// Decides the rights of exports. Two others ask rules or `accepts` themselves: the peer's wish for
// /clock (ClockPublisher), and the search for the cause of a missing name (MissingNames).
[[nodiscard]] ExportRight export_right(const SideView& side, const Link& link,
                                       const LocalInterface& what);
// The same for any interface, also one that does not exist here.
[[nodiscard]] ExportRight export_right(const SideView& side, const Link& link,
                                       const Interface& what);
// Whether the peer sees this topic as /parameter_events: each of its origins then has a right of
// its own.
[[nodiscard]] bool are_parameter_events(const Link& link, const LocalInterface& what);
// Whether the peer receives the parameter events of a node (local name), which is an origin of
// /parameter_events.
[[nodiscard]] bool may_have_events(const SideView& side, const Link& link, std::string_view node);

}  // namespace connect_bridge
