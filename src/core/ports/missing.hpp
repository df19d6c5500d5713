// What somebody at this side wants and does not get from, or to, a peer.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "core/wire/words.hpp"

namespace connect_bridge {

// Why a name does not cross.
enum class MissingReason : std::uint8_t {
  kNoRule,       // no rule here names it
  kOtherPeer,    // a rule here allows it to other peers only
  kDenied,       // a rule here denies it
  kRuleType,     // a rule here names it, and allows other types only
  kNotTaken,     // exported: the peer's rules do not take it
  kNotGiven,     // imported: the peer's rules do not let this side have it
  kOtherType,    // it exists at the peer, or is listened to there, with another type
  kNotThere,     // nobody publishes or serves it there
  kTypeUnknown,  // its type is not installed where it has to be
  kDeclined,     // the importer declined it, and said why
  kQos,          // a subscriber requests what no publisher offers
  kLost,         // many of its samples are lost before they reach the bridge
};

inline constexpr std::array<Word<MissingReason>, 12> kMissingWords{{
    {MissingReason::kNoRule, "no_rule"},
    {MissingReason::kOtherPeer, "other_peer"},
    {MissingReason::kDenied, "denied"},
    {MissingReason::kRuleType, "rule_type"},
    {MissingReason::kNotTaken, "not_taken"},
    {MissingReason::kNotGiven, "not_given"},
    {MissingReason::kOtherType, "other_type"},
    {MissingReason::kNotThere, "not_there"},
    {MissingReason::kTypeUnknown, "type_unknown"},
    {MissingReason::kDeclined, "declined"},
    {MissingReason::kQos, "qos"},
    {MissingReason::kLost, "lost"},
}};

// One name on one link.
struct MissingName {
  static constexpr std::size_t kMissingMax = 64;  // of a link

  InterfaceKind kind = InterfaceKind::kTopic;
  bool exported = false;  // published here; else somebody here subscribes or calls
  std::string name;       // local; of an action its own
  std::string type;
  MissingReason reason = MissingReason::kNoRule;
  std::string rule;  // of ours, that decides; empty: none does
  std::string text;  // one sentence

  friend bool operator==(const MissingName&, const MissingName&) = default;
};

}  // namespace connect_bridge
