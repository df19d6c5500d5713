// How a channel's messages wait to be sent, and what is counted of them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/priority.hpp"
#include "core/base/time.hpp"
#include "core/flow/drops.hpp"
#include "core/wire/codec.hpp"

namespace connect_bridge {

// How the outbox treats a channel. Depth and bytes limit what waits, not what is partly sent.
struct QueueOptions {
  Priority priority = Priority::kNormal;
  // Messages of at most kLightBytes may leave right behind the urgent ones, within a link's budget.
  bool may_be_light = false;
  // Keep-last. 0: keep all, and refuse the newest where there is no room.
  std::uint32_t depth = 100;
  // Bytes of bodies; one message always fits an empty queue. queue_bytes_max applies only while the
  // oldest message has waited for longer than kStalled; otherwise a burst may go up to
  // burst_bytes_max, which a fast link carries soon.
  std::uint64_t queue_bytes_max = 1 << 20;
  // A smaller value than queue_bytes_max means queue_bytes_max. The outbox reduces it to a share of
  // its own bound.
  std::uint64_t burst_bytes_max = 0;
  Duration lifespan = kForever;  // against the message's stamp, checked again when sending
  Duration max_age = kForever;   // as lifespan
  bool newest_only = false;      // depth 1; what a newer one displaces is kNewerAvailable
  // Nothing is dropped when the queue is full, neither here nor by the outbox's budget: the owner
  // limits what it pushes. Depth and bytes have no effect then.
  bool keep = false;
  // Small messages that are pushed uncompressed are compressed as they leave. With kAuto urgent
  // ones are not compressed.
  Compression compression;
};

inline constexpr std::size_t kLightBytes = 1024;
inline constexpr Duration kStalled = std::chrono::milliseconds(250);
// How long a message that no newer one replaces waits on a link that carries less than is
// published.
inline constexpr Duration kWaitMax = std::chrono::seconds(5);

// Counts of one channel, all since it was added. accepted = sent + dropped (all reasons) + queued.
struct ChannelCounts {
  std::uint64_t accepted = 0;
  std::uint64_t sent = 0;        // whole messages handed to the connection
  std::uint64_t sent_bytes = 0;  // their body bytes
  DropCounts dropped;
  std::uint64_t queued = 0;        // the partly sent one included
  std::uint64_t queued_bytes = 0;  // whole bodies
};

}  // namespace connect_bridge
