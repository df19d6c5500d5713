// How much may wait on a link, and in what sizes it leaves.
#pragma once

#include <cstdint>

#include "core/base/time.hpp"

namespace connect_bridge {

struct OutboxOptions {
  // Largest part of a message in one packet; the rate of the link decides (Pacer). The default
  // keeps an urgent message 2 ms behind a part at 1 Gbit/s. At most half of
  // unacknowledged_bytes_max is used.
  std::uint32_t fragment_bytes = 256 << 10;
  // Small parts are gathered into a packet up to this size (likewise); a part larger than it ends
  // the packet.
  std::uint32_t packet_bytes = 65536;
  // How long what is not urgent may keep the queues on the way; zero: as long as they take it.
  Duration queue_delay_target = std::chrono::milliseconds(2);
  // Of IP packets (LinkCap). What is not urgent is held back for it; 0: no limit.
  std::uint64_t bytes_per_second_max = 0;
  // Binary packet bytes sent and not yet acknowledged.
  std::uint64_t unacknowledged_bytes_max = 16 << 20;
  // Of control texts; beyond: the link closes with kSlowPeer.
  std::uint64_t control_bytes_max = 8 << 20;
  // Bodies in all channels' queues together; beyond: the oldest of the lowest class goes.
  std::uint64_t data_bytes_max = 64 << 20;
};

// By how much urgent messages may pass unacknowledged_bytes_max. Acks, time frames and aborts are
// never held back: they are small and few, and two sides whose acks wait for each other would wait
// for ever.
inline constexpr std::uint64_t kUrgentReserveBytes = 64 << 10;

}  // namespace connect_bridge
