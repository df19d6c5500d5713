// How often the checkers had something to check: a checker without input finds nothing.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace connect_bridge::sim {

enum class Judged : std::uint8_t {
  kUrgent,
  kTurns,
  kQuiet,
  kHistory,
  kLastWords,
  kClocks,
  kAges,
  kOffences,
  kTolerated,
  kStrangeRequests,
  kStrangeAnswers,
  kExecutions,
  kAnswers,
  kDrops,
  kCaps,
  kTruths,
  kFullQueues,
  kLosses,
  kQuietCalls,
  kUnbroken,
  kBreaks,
  kCommands,
  kListeners,
  kFirstWords,
  kMetered,
  kMissing,
  kStates,
  kCount,
};

inline constexpr std::size_t kJudgedCount = static_cast<std::size_t>(Judged::kCount);

// In the order of Judged.
inline constexpr std::array<std::string_view, kJudgedCount> kJudgedNames = {
    "urgent messages timed",
    "queues seen waiting for their turn",
    "messages expected at a subscriber after quiet",
    "samples expected at a late subscriber",
    "messages of publishers that ended at once",
    "clock offsets compared",
    "messages with a lifespan or max_age begun to be sent",
    "ways in which strangers broke the protocol",
    "odd things of strangers that are allowed",
    "calls of strangers that a server executed",
    "answers of strangers that a caller got",
    "calls that a server executed",
    "calls that a mirror answered",
    "calls that a mirror gave up",
    "calls under way compared with their caps",
    "services whose mirrors were compared with their servers",
    "servers' queues that one bridge has filled",
    "calls lost in a queue that several callers share",
    "calls expected to be answered after quiet",
    "messages expected without a gap, whatever was cut",
    "connections lost that were to cost no message",
    "messages that must not be late compared with the opening of their connection",
    "topics expected to be subscribed for listeners of the other side",
    "first messages of new publishers expected at listeners of the other side",
    "packets under a cap in bytes per second",
    "names that do not cross compared with the rules",
    "messages of thin links compared with the age that is right",
};

class Coverage {
 public:
  void count(Judged what, std::uint64_t times = 1) { counts_[index_of(what)] += times; }
  [[nodiscard]] std::uint64_t of(Judged what) const { return counts_[index_of(what)]; }
  Coverage& operator+=(const Coverage& more) {
    for (std::size_t i = 0; i < kJudgedCount; ++i) counts_[i] += more.counts_[i];
    return *this;
  }

 private:
  static std::size_t index_of(Judged what) { return static_cast<std::size_t>(what); }

  std::array<std::uint64_t, kJudgedCount> counts_{};
};

}  // namespace connect_bridge::sim
