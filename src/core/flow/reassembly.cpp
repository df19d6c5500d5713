#include "core/flow/reassembly.hpp"

#include <string>
#include <utility>

#include "core/base/check.hpp"

namespace connect_bridge {
namespace {

Error refusal(CloseCode code, ChannelId channel, const char* what) {
  return Error{code, "channel " + std::to_string(channel.value) + ": " + what};
}

// Sequence numbers rise and go from the largest to 1; gaps are messages the sender gave up. So
// `next` is behind `last` if it lies in the half of the circle before it (serial number arithmetic,
// RFC 1982).
bool is_after(std::uint32_t next, std::uint32_t last) {
  return next != 0 && static_cast<std::int32_t>(next - last) > 0;
}

// The slice of `packet` in which `part` lies.
Payload slice_of(const Payload& packet, ByteView part) {
  if (part.empty()) return {};
  const auto* begin = packet.view().data();
  CONNECT_CHECK(part.data() >= begin && part.data() + part.size() <= begin + packet.size());
  return packet.slice(static_cast<std::size_t>(part.data() - begin), part.size());
}

}  // namespace

Result<std::optional<InMessage>> Reassembly::on_message(Stream& stream, const MessageFrame& frame,
                                                        const Payload& packet, bool keep) {
  // Sizes first, against limits that nothing of the peer's can change; then whether they fit each
  // other; then whether this channel may begin a message now. Memory is taken after the last check.
  if (frame.raw_bytes > options_.message_bytes_max ||
      frame.body_bytes > options_.message_bytes_max) {
    return refusal(CloseCode::kTooLarge, frame.channel,
                   "a message beyond the largest accepted size");
  }
  if (frame.part.size() > frame.body_bytes || (frame.part.empty() && frame.body_bytes > 0) ||
      (frame.codec == Codec::kNone && frame.raw_bytes != frame.body_bytes)) {
    return refusal(CloseCode::kMalformed, frame.channel, "sizes that contradict each other");
  }
  if (stream.open_) {
    return refusal(CloseCode::kIllegal, frame.channel, "a message begins inside another one");
  }
  if (!is_after(frame.sequence, stream.last_sequence_)) {  // mutant: sequence
    return refusal(CloseCode::kIllegal, frame.channel, "a sequence number that does not rise");
  }
  InMessage message{frame, frame.channel, {}};
  if (frame.part.size() == frame.body_bytes) {
    stream.last_sequence_ = frame.sequence;
    message.body = slice_of(packet, frame.part);
    return std::optional<InMessage>{std::move(message)};
  }
  const bool fits = !memory_ || frame.body_bytes <= memory_->room();  // mutant: reassembly_memory
  // Later messages refer to a message that makes a base, so it cannot be skipped.
  if (keep && !fits && makes_base(frame.codec))
    return refusal(CloseCode::kTooLarge, frame.channel,
                   "no memory is left for unfinished messages");
  message.kept = keep && fits;
  const std::uint32_t kept = message.kept ? frame.body_bytes : 0;
  if (open_->used() + kept > options_.open_bytes_max) {  // mutant: unfinished
    return refusal(CloseCode::kTooLarge, frame.channel, "too many bytes in unfinished messages");
  }
  stream.last_sequence_ = frame.sequence;
  const auto missing = frame.body_bytes - static_cast<std::uint32_t>(frame.part.size());
  auto& open = stream.open_.emplace(Stream::Open{std::move(message), missing, {}, {}});
  if (kept == 0) return std::optional<InMessage>{};
  open.kept = open_->hold(kept);
  // Reserves all at once: it is within the budget, and memory pages that the peer never fills are
  // never touched.
  open.body.reserve(frame.body_bytes);
  open.body.insert(open.body.end(), frame.part.begin(), frame.part.end());
  return std::optional<InMessage>{};
}

Result<std::optional<InMessage>> Reassembly::on_part(Stream& stream, const PartFrame& frame) {
  if (!stream.open_) {
    return refusal(CloseCode::kIllegal, frame.channel, "a part without an open message");
  }
  auto& open = *stream.open_;
  if (frame.abort) {
    stream.open_.reset();  // mutant: abort
    return std::optional<InMessage>{};
  }
  if (frame.part.empty() || frame.part.size() > open.missing) {
    return refusal(CloseCode::kMalformed, frame.channel, "a part that is empty or too long");
  }
  open.missing -= static_cast<std::uint32_t>(frame.part.size());
  // The parts of what is not kept are counted only: a peer must send them as the protocol says.
  if (open.message.kept) open.body.insert(open.body.end(), frame.part.begin(), frame.part.end());
  if (open.missing > 0) return std::optional<InMessage>{};
  auto message = std::move(open.message);
  message.body = Payload::adopt(std::move(open.body));
  stream.open_.reset();
  return std::optional<InMessage>{std::move(message)};
}

}  // namespace connect_bridge
