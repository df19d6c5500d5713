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

// A topic or a service here, and what peers call it.
struct LocalInterface {
  InterfaceKind kind;                       // kTopic or kService
  std::pair<std::string, std::string> key;  // local name, type
  std::optional<std::string> wire_name;     // none: it is not visible to peers
  bool parameter_events = false;            // of all nodes: each origin has its own right

  // Of what is not visible, its own name.
  [[nodiscard]] const std::string& shown_name() const { return wire_name ? *wire_name : key.first; }
};

[[nodiscard]] std::shared_ptr<const LocalInterface> local_interface(
    const SideView& side, InterfaceKind kind, std::pair<std::string, std::string> key);

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

// Nobody else asks rules or `accepts` about what is exported, but for the peer's wish for /clock
// (ClockPublisher).
[[nodiscard]] ExportRight export_right(const SideView& side, const Link& link,
                                       const LocalInterface& what);
// The same for any interface, whether it is here or not.
[[nodiscard]] ExportRight export_right(const SideView& side, const Link& link,
                                       const Interface& what);
// Whether the peer gets the events of a node's parameters (local name), which are origins of
// /parameter_events.
[[nodiscard]] bool may_have_events(const SideView& side, const Link& link, std::string_view node);

}  // namespace connect_bridge
