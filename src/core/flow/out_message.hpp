// A message on its way to a peer.
#pragma once

#include <cstdint>
#include <deque>

#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/wire/codec.hpp"

namespace connect_bridge {

// In the form in which it is sent.
struct OutMessage {
  Subject subject;
  std::uint16_t demand = 0;  // as in MessageFrame
  Stamp stamp = 0;           // 0: not known, so the message has no age
  std::uint64_t number = 0;  // as in MessageFrame
  Codec codec = Codec::kNone;
  std::uint32_t raw_bytes = 0;  // size after decompression; without a codec the body's size is used
  Payload body;
  bool tracked = false;        // its arrival is reported to the owner (Outbox::take_delivered)
  bool resumes = false;        // kept until it has arrived, to be sent again on another connection
  std::uint32_t sequence = 0;  // as in MessageFrame; 0: it was never begun
};

// What may not have arrived when a connection was lost, and the last sequence number there.
struct UnarrivedMessages {
  std::deque<OutMessage> messages;
  std::uint32_t last_sequence = 0;
};

// What each message counts in addition to its body where depth drops nothing.
inline constexpr std::uint64_t kKeptMessageBytes = 128;

[[nodiscard]] inline std::uint64_t kept_bytes_of(const OutMessage& message) {
  return message.body.size() + kKeptMessageBytes;
}

}  // namespace connect_bridge
