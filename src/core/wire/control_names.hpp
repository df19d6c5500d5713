// The names that members of control messages have. docs/protocol.md section "Control messages".
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace connect_bridge {

// All of them, sorted: what a message holds under another name is skipped unread.
inline constexpr auto kControlNames = [] {
  auto names = std::to_array<std::string_view>({
      "accepted",
      "action_type",
      "actions",
      "added",
      "after",
      "calls",
      "channel",
      "channels",
      "code",
      "codes",
      "complete",
      "credential",
      "deadline_ns",
      "deny",
      "depth",
      "durability",
      "epoch",
      "gid",
      "history",
      "kind",
      "lifespan_ns",
      "listener",
      "live",
      "liveliness",
      "liveliness_lease_ns",
      "message_bytes_max",
      "method",
      "name",
      "names",
      "newest_only",
      "node",
      "number",
      "origin",
      "origins",
      "parameters",
      "priority",
      "qos",
      "reason",
      "reliability",
      "removed",
      "requests",
      "resume",
      "ros_time",
      "rules",
      "seen",
      "services",
      "topics",
      "type",
      "type_hash",
      "types",
  });
  std::ranges::sort(names);
  return names;
}();

// One of them.
class MemberName {
 public:
  // A name that is not in the list does not compile.
  consteval MemberName(const char* name)  // NOLINT(google-explicit-constructor): a literal is one
      : index_(index_of(name).value()) {}

  // Nothing: no control message has a member of this name.
  [[nodiscard]] static constexpr std::optional<MemberName> find(std::string_view name) {
    const auto index = index_of(name);
    return index ? std::optional(MemberName(*index)) : std::nullopt;
  }

  [[nodiscard]] constexpr std::string_view text() const { return kControlNames[index_]; }

  friend constexpr bool operator==(MemberName, MemberName) = default;

 private:
  explicit constexpr MemberName(std::uint8_t index) : index_(index) {}

  static constexpr std::optional<std::uint8_t> index_of(std::string_view name) {
    const auto at = std::ranges::lower_bound(kControlNames, name);
    if (at == kControlNames.end() || *at != name) return std::nullopt;
    return static_cast<std::uint8_t>(at - kControlNames.begin());
  }

  std::uint8_t index_;
};

}  // namespace connect_bridge
