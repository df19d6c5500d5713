// Binary frames after login: a WebSocket binary message (a packet) holds one or more frames.
// docs/protocol.md section "Data packets". All numbers are little-endian.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <variant>

#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "core/wire/codec.hpp"

namespace connect_bridge {

// The facts about a message beside its body.
struct MessageHead {
  Subject subject;
  std::uint32_t sequence = 0;  // counts the messages of the channel on this connection, from 1
  std::uint16_t demand = 0;    // topics: the number of the demand under which it is sent
  Stamp stamp = 0;             // source time of the sample (system clock of the origin's host)
  std::uint64_t number = 0;    // topics: rises with each sample of the origin; 0: unknown
  Codec codec = Codec::kNone;
  std::uint32_t raw_bytes = 0;  // size after decompression
};

// Starts a message on a channel and carries its first part (or all of it).
struct MessageFrame : MessageHead {
  ChannelId channel;
  std::uint32_t body_bytes = 0;  // size of all parts together; equals raw_bytes when codec is kNone
  ByteView part;
};

// Continues the open message of a channel; `abort` ends it unfinished (no part then).
struct PartFrame {
  ChannelId channel;
  bool abort = false;
  ByteView part;
};

// Cumulative count of packet bytes (binary WebSocket payload) that arrived on this connection.
// `arrived`: when the last of them arrived, by a steady clock of the receiver, in ns since an
// arbitrary start.
struct AckFrame {
  std::uint64_t received_bytes = 0;
  Stamp arrived = 0;
};

// The packet with this frame is to be acknowledged at once.
struct AckRequest {};

// Four-stamp clock measurement and sign of life (NTP, RFC 5905 section 8): t1 sent, t2 received,
// t3 answered. System clock, ns.
struct TimeRequest {
  Stamp t1 = 0;
};
struct TimeReply {
  Stamp t1 = 0;
  Stamp t2 = 0;
  Stamp t3 = 0;
  Stamp ros = 0;  // ROS time of the answering node at t3; 0 when it has none
};

// Control messages, with a line feed between two, compressed as the difference to those before
// (core/flow/text_history.hpp). The frame is a message of its own, for which no part follows.
struct TextsFrame {
  bool kept = false;            // they follow texts of an earlier connection, which both sides keep
  std::uint32_t raw_bytes = 0;  // size after decompression
  ByteView body;
};

using Frame =
    std::variant<MessageFrame, PartFrame, AckFrame, TimeRequest, TimeReply, AckRequest, TextsFrame>;

// The largest stamp on the wire (the year 2116). Every stamp is 0 (unknown) to this, so that sums
// and differences of two fit 64 bits. append_header writes any other value as 0.
inline constexpr Stamp kWireStampMax = (Stamp{1} << 62) - 1;

// Largest WebSocket message after login, binary or text; a larger one is refused with kTooLarge.
inline constexpr std::size_t kPacketBytesMax = 1 << 20;

// The body in a form that may wait. A body of a single part is a slice of its packet and would keep
// all of the packet in memory, so it is copied.
[[nodiscard]] inline Payload out_of_packet(const Payload& body) {
  return body.size() <= kPacketBytesMax ? Payload::copy_of(body.view()) : body;
}

inline constexpr std::size_t kMessageHeaderBytes = 44;
inline constexpr std::size_t kPartHeaderBytes = 12;
inline constexpr std::size_t kAckBytes = 24;
inline constexpr std::size_t kTimeRequestBytes = 16;
inline constexpr std::size_t kTimeReplyBytes = 40;
inline constexpr std::size_t kAckRequestBytes = 8;
inline constexpr std::size_t kTextsHeaderBytes = 12;

// Limits of one TextsFrame. All its control messages are handled in one step.
inline constexpr std::uint32_t kTextsRawMax = 32 << 10;
inline constexpr std::size_t kTextsMax = 64;

// More frames in a packet would keep the receiver's loop busy for too long at a time
// (docs/protocol.md, section 6).
inline constexpr std::uint32_t kPacketFramesMax = 1024;

// Reads the frames of one packet in order. Parts refer to the packet's bytes. Never allocates
// except for an error text.
class FrameReader {
 public:
  explicit FrameReader(ByteView packet) : rest_(packet) {}

  // The next frame; nullopt at the end of the packet. An error (kMalformed) is anything that is not
  // exactly as specified: unknown type, non-zero reserved byte, length beyond the packet, part
  // longer than its body, unknown codec, codec none with raw_bytes != body_bytes, an empty part of
  // a body that is not empty, channel, origin or sequence 0, a stamp beyond kWireStampMax. An error
  // stays: the rest of the packet is not read.
  Result<std::optional<Frame>> next();

 private:
  ByteView rest_;
};

// Appends a frame's header to `out`; for ack and time frames that is the whole frame. Parts of
// messages are not appended: they are sent without a copy.
void append_header(const Frame& frame, Bytes& out);

}  // namespace connect_bridge
