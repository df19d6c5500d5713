// Whether only the newest message of a topic's publisher counts, or each one.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "core/policy/treatment.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {

// What is known of a topic's publishers and type, after the rule's overrides of QoS.
struct TopicTraits {
  bool best_effort = false;   // of all of them
  bool keep_all = false;      // of one of them
  std::uint32_t latched = 0;  // samples that one of them keeps for late subscribers
  bool has_header = false;    // the type is installed and begins with a std_msgs/msg/Header
};

inline constexpr std::array<Word<Keep>, 2> kKeepWords{{
    {Keep::kNewest, "newest"},
    {Keep::kAll, "all"},
}};

struct KeepDecision {
  Keep keep = Keep::kAll;
  std::string_view why;  // for people
};

// The rule's, else: of a state (a pose, an image, a scan, /tf) the newest message replaces the
// earlier ones, of events and increments (logs, goals' feedback, updates of a map) each one counts.
// What is best effort, or begins with a Header, is taken for a state.
[[nodiscard]] KeepDecision keep_of(const Treatment& treatment, std::string_view type,
                                   const TopicTraits& traits);

}  // namespace connect_bridge
