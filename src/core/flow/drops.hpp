// Why a message was not delivered. Every drop is counted under one of these.
#pragma once

#include <array>
#include <cstdint>
#include <numeric>
#include <string_view>

namespace connect_bridge {

enum class DropReason : std::uint8_t {
  kQueueDepth,      // keep-last: displaced by a newer message
  kQueueBytes,      // the channel's or the link's byte budget
  kQueueTime,       // waited for too long on a link that carries less than is published
  kLifespan,        // older than the origin's lifespan
  kMaxAge,          // older than the rule's max_age
  kRate,            // the rule's max_rate or max_bytes_per_second
  kTooLarge,        // larger than max_message_size of either side
  kNoDemand,        // demand ended while it was queued or on its way
  kWithdrawn,       // the channel was withdrawn
  kLinkLost,        // the link ended
  kUnknownOrigin,   // its publisher never appeared in the graph
  kDuplicate,       // a transient-local sample that was delivered before
  kNewerAvailable,  // newest-only channel, or overload: a newer message tells the same state
  kPublishFailed,   // the local middleware refused it
  kMemory,          // memory_max: this peer's share of it was used up
  kNotPermitted,    // a parameter event of a node that no rule opens, or not of its origin's
  kResumeBound,     // kept for a lost link, beyond the bytes or the time for that
  kLostHere,        // exported: lost in the local middleware before this side got it
  kWheel,           // a command of a peer that may not steer now
  kGroup,           // a packet of a video that refers to one that did not leave
  kCount,
};

inline constexpr std::size_t kDropReasons = static_cast<std::size_t>(DropReason::kCount);

std::string_view name_of(DropReason reason);

struct DropCounts {
  std::array<std::uint64_t, kDropReasons> by_reason{};
  void add(DropReason reason, std::uint64_t n = 1) {
    by_reason[static_cast<std::size_t>(reason)] += n;
  }
  [[nodiscard]] std::uint64_t of(DropReason reason) const {
    return by_reason[static_cast<std::size_t>(reason)];
  }
  [[nodiscard]] std::uint64_t total() const {
    return std::accumulate(by_reason.begin(), by_reason.end(), std::uint64_t{0});
  }
};

}  // namespace connect_bridge
