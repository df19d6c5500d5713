// The words that stand for enumerators in control messages. docs/protocol.md section "Control
// messages".
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "core/base/priority.hpp"
#include "core/base/qos.hpp"
#include "core/wire/control.hpp"

namespace connect_bridge {

template <class Enum>
struct Word {
  Enum value;
  std::string_view word;
};

inline constexpr std::array<Word<InterfaceKind>, 3> kKindWords{{
    {InterfaceKind::kTopic, "topic"},
    {InterfaceKind::kService, "service"},
    {InterfaceKind::kAction, "action"},
}};
inline constexpr std::array<Word<Priority>, kPriorities> kPriorityWords{{
    {Priority::kUrgent, "urgent"},
    {Priority::kHigh, "high"},
    {Priority::kNormal, "normal"},
    {Priority::kBulk, "bulk"},
}};
inline constexpr std::array<Word<Reliability>, 2> kReliabilityWords{{
    {Reliability::kBestEffort, "best_effort"},
    {Reliability::kReliable, "reliable"},
}};
inline constexpr std::array<Word<Durability>, 2> kDurabilityWords{{
    {Durability::kVolatile, "volatile"},
    {Durability::kTransientLocal, "transient_local"},
}};
inline constexpr std::array<Word<History>, 2> kHistoryWords{{
    {History::kKeepLast, "keep_last"},
    {History::kKeepAll, "keep_all"},
}};
inline constexpr std::array<Word<Liveliness>, 2> kLivelinessWords{{
    {Liveliness::kAutomatic, "automatic"},
    {Liveliness::kManualByTopic, "manual_by_topic"},
}};

inline constexpr std::array<Word<WheelState>, 4> kWheelStateWords{{
    {WheelState::kFree, "free"},
    {WheelState::kYours, "yours"},
    {WheelState::kTaken, "taken"},
    {WheelState::kHalted, "halted"},
}};
inline constexpr std::array<Word<WheelWant>, 2> kWheelWantWords{{
    {WheelWant::kTake, "take"},
    {WheelWant::kLeave, "leave"},
}};
inline constexpr std::array<Word<bool Decodes::*>, 3> kDecodesWords{{
    {&Decodes::vp8, "vp8"},
    {&Decodes::cloud, "cloud"},
    {&Decodes::planes, "planes"},
}};

template <class Words, class Enum>
[[nodiscard]] constexpr std::string_view word_of(const Words& words, Enum value) {
  for (const auto& entry : words) {
    if (entry.value == value) return entry.word;
  }
  return "other";
}

template <class Enum, std::size_t N>
[[nodiscard]] constexpr std::optional<Enum> value_of(const std::array<Word<Enum>, N>& words,
                                                     std::string_view word) {
  for (const auto& entry : words) {
    if (entry.word == word) return entry.value;
  }
  return std::nullopt;
}

}  // namespace connect_bridge
