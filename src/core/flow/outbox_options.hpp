// How much may wait on a link, and in what sizes it leaves.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/base/time.hpp"
#include "core/wire/frame.hpp"

namespace connect_bridge {

struct OutboxOptions {
  // Largest part of a message in one packet; the rate of the link decides (Pacer). The default
  // keeps an urgent message 2 ms behind a part at 1 Gbit/s. At most half of
  // unacknowledged_bytes_max is used.
  std::uint32_t fragment_bytes = 256 << 10;
  // Small parts are gathered into a packet up to this size (reduced in the same way); a larger part
  // ends the packet.
  std::uint32_t packet_bytes = 65536;
  // How much delay data that is not urgent may cause in the queues on the path; zero: no limit, it
  // is sent as fast as TCP accepts it.
  Duration queue_delay_target = std::chrono::milliseconds(2);
  // Bytes of IP packets (LinkCap). Data that is not urgent is held back to keep it; 0: no limit.
  std::uint64_t bytes_per_second_max = 0;
  // Binary packet bytes sent and not yet acknowledged.
  std::uint64_t unacknowledged_bytes_max = 16 << 20;
  // From so many bytes on, texts that wait are compressed; from more on if the history is long.
  std::size_t compressed_texts_min = 512;
  // Bytes of waiting control texts; beyond it the connection closes with kSlowPeer. The offers of a
  // large graph, with some ten publishers for each topic, wait at once.
  std::uint64_t control_bytes_max = 32 << 20;
  // Bytes of bodies in the queues of all channels together; beyond it the oldest message of the
  // lowest class is dropped.
  std::uint64_t data_bytes_max = 64 << 20;
};

// A packet holds at most a gathered part (packet_bytes), one fragment and headers; it must stay
// below the size that every receiver accepts.
[[nodiscard]] inline OutboxOptions bounded(OutboxOptions options) {
  // A fragment must fit into the window while acknowledgements for the other half are on their way.
  const auto half_window = std::max<std::uint64_t>(options.unacknowledged_bytes_max / 2, 1);
  const auto fragment_max = std::min<std::uint64_t>(half_window, kPacketBytesMax / 2);
  options.fragment_bytes = static_cast<std::uint32_t>(
      std::clamp<std::uint64_t>(options.fragment_bytes, 1, fragment_max));
  options.packet_bytes = std::min<std::uint32_t>(options.packet_bytes, kPacketBytesMax / 4);
  return options;
}

// By how much urgent messages may exceed unacknowledged_bytes_max. Acks, time frames and aborts are
// never held back: they are small and few, and two sides whose acks wait for each other would wait
// for ever.
inline constexpr std::uint64_t kUrgentReserveBytes = 64 << 10;

}  // namespace connect_bridge
