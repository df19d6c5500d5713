#include "core/wire/frame.hpp"

#include <string>
#include <utility>

#include "core/base/byte_order.hpp"

namespace connect_bridge {
namespace {

// docs/protocol.md section "Data packets".
enum class FrameType : std::uint8_t {
  kMessage = 1,
  kPart = 2,
  kAck = 3,
  kTimeRequest = 4,
  kTimeReply = 5,
  kAckRequest = 6,
  kTexts = 7
};

constexpr std::uint8_t kAbortFlag = 1;
constexpr std::uint8_t kKeptFlag = 1;
constexpr std::size_t kZeroBytesBeforeNumbers = 8;  // ack and time frames: type and 7 zero bytes

using Outcome = Result<std::optional<Frame>>;

bool all_zero(ByteView bytes) {
  for (const auto byte : bytes) {
    if (byte != 0) return false;
  }
  return true;
}

bool is_stamp(Stamp value) {
  return value >= 0 && value <= kWireStampMax;
}

// A clock or a middleware can return any value; a value out of range is sent as "unknown".
Stamp wire_stamp(Stamp value) {
  return is_stamp(value) ? value : 0;
}

std::size_t header_bytes(FrameType type) {
  switch (type) {
    case FrameType::kMessage: return kMessageHeaderBytes;
    case FrameType::kPart: return kPartHeaderBytes;
    case FrameType::kAck: return kAckBytes;
    case FrameType::kTimeRequest: return kTimeRequestBytes;
    case FrameType::kTimeReply: return kTimeReplyBytes;
    case FrameType::kAckRequest: return kAckRequestBytes;
    case FrameType::kTexts: return kTextsHeaderBytes;
  }
  return 0;
}

// Cuts the part that follows a header off `rest`; nullopt when the packet is shorter.
std::optional<ByteView> take_part(ByteView& rest, std::size_t header, std::uint32_t part_bytes) {
  // FrameReader::next has checked the header, so this does not go below zero; a sum could overflow.
  if (rest.size() - header < part_bytes) return std::nullopt;
  const ByteView part = rest.subspan(header, part_bytes);
  rest = rest.subspan(header + part_bytes);
  return part;
}

// Refuses errors that are wrong in every state. The link and Reassembly judge errors that depend on
// the channel (its existence, its sequence, its open message), in the order of the frames.
Outcome read_message(ByteView& rest) {
  MessageFrame frame;
  const auto codec = rest[1];
  if (codec > static_cast<std::uint8_t>(Codec::kPlanes)) {
    return malformed("a message frame has the unknown codec " + std::to_string(codec));
  }
  frame.codec = static_cast<Codec>(codec);
  frame.demand = get_le<std::uint16_t>(rest, 2);
  frame.channel.value = get_le<std::uint32_t>(rest, 4);
  frame.subject.value = get_le<std::uint32_t>(rest, 8);
  frame.sequence = get_le<std::uint32_t>(rest, 12);
  frame.stamp = get_le<Stamp>(rest, 16);
  frame.number = get_le<std::uint64_t>(rest, 24);
  frame.raw_bytes = get_le<std::uint32_t>(rest, 32);
  frame.body_bytes = get_le<std::uint32_t>(rest, 36);
  const auto part_bytes = get_le<std::uint32_t>(rest, 40);
  if (!frame.channel) return malformed("a message frame has channel 0");
  if (!frame.subject) return malformed("a message frame has origin 0");
  if (frame.sequence == 0) return malformed("a message frame has sequence 0");
  if (!is_stamp(frame.stamp)) return malformed("a message frame's stamp is out of range");
  if (frame.codec == Codec::kNone && frame.raw_bytes != frame.body_bytes) {
    return malformed("an uncompressed message has different raw and body sizes");
  }
  if (frame.codec != Codec::kNone && (frame.raw_bytes == 0 || frame.body_bytes == 0)) {
    return malformed("a compressed message is empty");
  }
  if (frame.codec != Codec::kNone &&
      frame.body_bytes > compressed_bytes_max(frame.raw_bytes)) {  // mutant: compressed_bound
    return malformed("a compressed message is much larger than its sample");
  }
  if (makes_base(frame.codec) && frame.raw_bytes > kBaseBytesMax) {
    return malformed("a base is larger than a base may be");
  }
  if (part_bytes > frame.body_bytes) return malformed("a message's part is longer than its body");
  if (part_bytes == 0 && frame.body_bytes != 0) return malformed("a message's part is empty");
  const auto part = take_part(rest, kMessageHeaderBytes, part_bytes);
  if (!part) return malformed("a message's part ends beyond the packet");
  frame.part = *part;
  return std::optional<Frame>{frame};
}

Outcome read_part(ByteView& rest) {
  PartFrame frame;
  if ((rest[1] & ~kAbortFlag) != 0) return malformed("a part frame has an unknown flag");
  if (!all_zero(rest.subspan(2, 2))) return malformed("a reserved byte of a part is not zero");
  frame.abort = rest[1] == kAbortFlag;
  frame.channel.value = get_le<std::uint32_t>(rest, 4);
  const auto part_bytes = get_le<std::uint32_t>(rest, 8);
  if (!frame.channel) return malformed("a part frame has channel 0");
  if (frame.abort && part_bytes != 0) return malformed("an abort carries bytes");
  if (!frame.abort && part_bytes == 0) return malformed("a part is empty");
  const auto part = take_part(rest, kPartHeaderBytes, part_bytes);
  if (!part) return malformed("a part ends beyond the packet");
  frame.part = *part;
  return std::optional<Frame>{frame};
}

Outcome read_texts(ByteView& rest) {
  TextsFrame frame;
  if ((rest[1] & ~kKeptFlag) != 0) return malformed("a frame of texts has an unknown flag");
  if (!all_zero(rest.subspan(2, 2)))
    return malformed("a reserved byte of a frame of texts is not zero");
  frame.kept = rest[1] == kKeptFlag;
  frame.raw_bytes = get_le<std::uint32_t>(rest, 4);
  const auto body_bytes = get_le<std::uint32_t>(rest, 8);
  if (frame.raw_bytes == 0 || body_bytes == 0) return malformed("a frame of texts is empty");
  if (frame.raw_bytes > kTextsRawMax) return malformed("a frame has more texts than it may");
  if (body_bytes > compressed_bytes_max(frame.raw_bytes))
    return malformed("a frame of texts is much larger than these");
  const auto body = take_part(rest, kTextsHeaderBytes, body_bytes);
  if (!body) return malformed("a frame of texts ends beyond the packet");
  frame.body = *body;
  return std::optional<Frame>{frame};
}

// Ack and time frames: 7 zero bytes, then numbers; a request for an ack has none.
Outcome read_numbers(FrameType type, ByteView& rest) {
  if (!all_zero(rest.subspan(1, kZeroBytesBeforeNumbers - 1))) {
    return malformed("a reserved byte of an ack or time frame is not zero");
  }
  const ByteView numbers = rest.subspan(kZeroBytesBeforeNumbers);
  const ByteView behind = rest.subspan(header_bytes(type));
  if (type == FrameType::kAck) {
    const auto arrived = get_le<Stamp>(numbers, 8);
    if (!is_stamp(arrived)) return malformed("an ack's time of arrival is out of range");
    rest = behind;
    return std::optional<Frame>{AckFrame{get_le<std::uint64_t>(numbers, 0), arrived}};
  }
  if (type == FrameType::kAckRequest) {
    rest = behind;
    return std::optional<Frame>{AckRequest{}};
  }
  TimeReply frame;
  frame.t1 = get_le<Stamp>(numbers, 0);
  if (type == FrameType::kTimeReply) {
    frame.t2 = get_le<Stamp>(numbers, 8);
    frame.t3 = get_le<Stamp>(numbers, 16);
    frame.ros = get_le<Stamp>(numbers, 24);
  }
  for (const Stamp stamp : {frame.t1, frame.t2, frame.t3, frame.ros}) {
    if (!is_stamp(stamp)) return malformed("a time frame's stamp is out of range");
  }
  rest = behind;
  if (type == FrameType::kTimeRequest) return std::optional<Frame>{TimeRequest{frame.t1}};
  return std::optional<Frame>{frame};
}

// A header of N bytes, zero where nothing is set. It is appended in one step, because every part of
// every message has one.
template <std::size_t N>
class Header {
 public:
  explicit Header(FrameType type) { bytes_[0] = static_cast<std::uint8_t>(type); }
  template <class T>
  Header& set(std::size_t offset, T value) {
    set_le(value, bytes_, offset);
    return *this;
  }
  void append_to(Bytes& out) const { out.insert(out.end(), bytes_.begin(), bytes_.end()); }

 private:
  std::array<std::uint8_t, N> bytes_{};
};

void append(const MessageFrame& frame, Bytes& out) {
  Header<kMessageHeaderBytes>{FrameType::kMessage}
      .set(1, static_cast<std::uint8_t>(frame.codec))
      .set(2, frame.demand)
      .set(4, frame.channel.value)
      .set(8, frame.subject.value)
      .set(12, frame.sequence)
      .set(16, wire_stamp(frame.stamp))
      .set(24, frame.number)
      .set(32, frame.raw_bytes)
      .set(36, frame.body_bytes)
      .set(40, static_cast<std::uint32_t>(frame.part.size()))
      .append_to(out);
}

void append(const PartFrame& frame, Bytes& out) {
  Header<kPartHeaderBytes>{FrameType::kPart}
      .set(1, frame.abort ? kAbortFlag : std::uint8_t{0})
      .set(4, frame.channel.value)
      .set(8, static_cast<std::uint32_t>(frame.part.size()))
      .append_to(out);
}

void append(const AckFrame& frame, Bytes& out) {
  Header<kAckBytes>{FrameType::kAck}
      .set(8, frame.received_bytes)
      .set(16, wire_stamp(frame.arrived))
      .append_to(out);
}

void append(const AckRequest&, Bytes& out) {
  Header<kAckRequestBytes>{FrameType::kAckRequest}.append_to(out);
}

void append(const TimeRequest& frame, Bytes& out) {
  Header<kTimeRequestBytes>{FrameType::kTimeRequest}.set(8, wire_stamp(frame.t1)).append_to(out);
}

void append(const TimeReply& frame, Bytes& out) {
  Header<kTimeReplyBytes>{FrameType::kTimeReply}
      .set(8, wire_stamp(frame.t1))
      .set(16, wire_stamp(frame.t2))
      .set(24, wire_stamp(frame.t3))
      .set(32, wire_stamp(frame.ros))
      .append_to(out);
}

void append(const TextsFrame& frame, Bytes& out) {
  Header<kTextsHeaderBytes>{FrameType::kTexts}
      .set(1, frame.kept ? kKeptFlag : std::uint8_t{0})
      .set(4, frame.raw_bytes)
      .set(8, static_cast<std::uint32_t>(frame.body.size()))
      .append_to(out);
}

}  // namespace

Outcome FrameReader::next() {
  if (rest_.empty()) return std::optional<Frame>{};
  // The type alone gives the length of the header, so the length is checked before any field is
  // read. After an error `rest_` still begins with the same frame: the error stays.
  const auto type = static_cast<FrameType>(rest_[0]);
  const std::size_t header = header_bytes(type);
  if (header == 0) return malformed("unknown frame type " + std::to_string(rest_[0]));
  if (rest_.size() < header) return malformed("a frame's header ends beyond the packet");
  if (type == FrameType::kMessage) return read_message(rest_);
  if (type == FrameType::kPart) return read_part(rest_);
  if (type == FrameType::kTexts) return read_texts(rest_);
  return read_numbers(type, rest_);
}

void append_header(const Frame& frame, Bytes& out) {
  std::visit([&out](const auto& kind) { append(kind, out); }, frame);
}

}  // namespace connect_bridge
