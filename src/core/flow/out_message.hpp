// A message on its way to a peer.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "core/base/bytes.hpp"
#include "core/flow/together.hpp"
#include "core/wire/frame.hpp"

namespace connect_bridge {

// A message of a video: a decoder can begin with it, or needs the one before of its camera.
enum class VideoPart : std::uint8_t { kNone, kKey, kRefers };

// In the form in which it is sent. Its sequence is 0 until it is begun, its stamp is 0 if it has no
// age, and without a codec the body's size is used for raw_bytes.
struct OutMessage : MessageHead {
  Payload body;
  // Set: it tells a state, and a newer message of the same subject and state replaces it. An event
  // has none.
  std::optional<std::uint64_t> state = {};
  Moment moment = {};
  VideoPart video = VideoPart::kNone;
  std::uint64_t camera = 0;     // of the video: a publisher may have several
  std::uint64_t refers_to = 0;  // order of the packet before of the camera (PacketGroups)
  // Rises by one with each sample of the origin; one that is missing was lost before. 0: not known.
  std::uint64_t order = 0;
  bool reports_leaving = false;  // the owner is told when all of it was handed out
  bool tracked = false;          // its arrival is reported to the owner (Outbox::acknowledge)
  bool resumes = false;  // kept until it has arrived, to be sent again on another connection
};

// Messages that may not have arrived when a connection was lost, and its last sequence number.
struct UnarrivedMessages {
  std::deque<OutMessage> messages;
  std::uint32_t last_sequence = 0;
};

// Bytes that each message counts in addition to its body if depth drops nothing.
inline constexpr std::uint64_t kKeptMessageBytes = 128;

[[nodiscard]] inline std::uint64_t kept_bytes_of(const OutMessage& message) {
  return message.body.size() + kKeptMessageBytes;
}

}  // namespace connect_bridge
