// One WebSocket message to send, and how frames are gathered into it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/wire/frame.hpp"

namespace connect_bridge {

// One WebSocket message to send: the concatenation of `pieces`.
struct Packet {
  bool text = false;
  std::vector<Payload> pieces;
  // The next packet is pulled when fewer bytes than this are unsent in the socket; 0: as for the
  // packet before.
  std::uint32_t unsent_bytes_max = 0;
  // Whether the next pull may give another packet although nothing happens before it.
  bool more = true;
  [[nodiscard]] std::size_t size() const;
};

// Parts up to this size are copied next to their headers, so that many small messages leave as one
// piece; larger ones are sent from where they are, without a copy.
inline constexpr std::size_t kCopiedPartBytesMax = 512;

// Gathers frames into one binary packet. Its buffers are kept from packet to packet.
class PacketBuilder {
 public:
  // A frame without a part: ack, time, abort.
  void add(const Frame& frame);
  // A frame whose part is `size` bytes of `body` from `offset` on.
  void add(const Frame& frame, const Payload& body, std::size_t offset, std::size_t size);

  [[nodiscard]] std::size_t size() const { return head_.size() + referred_bytes_; }
  [[nodiscard]] bool empty() const { return head_.empty(); }
  // Whether one more message fits into so many bytes, and the number of frames that a peer takes;
  // the rest of that is for ends of messages, acknowledgements and time. The first one always fits.
  [[nodiscard]] bool takes_more(std::size_t bytes_max) const {
    return empty() || (size() < bytes_max && frames_ < kPacketFramesMax - 64);
  }
  // Returns what was gathered; the builder is empty afterwards.
  Packet finish();

 private:
  struct Referred {
    std::size_t head_end;  // the piece follows after so many bytes of the head
    Payload part;
  };
  Bytes head_;
  std::vector<Referred> referred_;
  std::size_t referred_bytes_ = 0;
  std::uint32_t frames_ = 0;
};

}  // namespace connect_bridge
