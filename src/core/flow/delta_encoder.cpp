#include "core/flow/delta_encoder.hpp"

#include <utility>

#include "core/compress/compress.hpp"

namespace connect_bridge {
namespace {

// Encoding and decoding together, on a small processor (measured: half of that on a desktop).
constexpr double kSeconds = 20e-6;
constexpr double kSecondsPerByte = 20e-9;

}  // namespace

DeltaEncoder::Base* DeltaEncoder::base_of(const Message& message) {
  // The peer forgets its bases with each demand (docs/protocol.md section 6).
  const auto base = bases_.find(message.subject.value);
  if (base == bases_.end() || base->second.demand != message.demand)
    return nullptr;  // mutant: delta_demand
  return &base->second;
}

Codec DeltaEncoder::codec_for(const Message& message, const Base* base) const {
  if (!has_origins_) return Codec::kZstd;
  // The new base takes the place of the old one. Without room for it the message is compressed by
  // itself: to exceed the limit would end the connection.
  const auto others = budget_.used() - (base ? base->bytes.amount() : 0);
  if (others + message.raw.size() + kBaseOverheadBytes > kBasesBytesMax) return Codec::kZstd;
  return base && base->deltas < kDeltasMax ? Codec::kZstdDelta : Codec::kZstdBase;
}

std::optional<DeltaEncoder::Body> DeltaEncoder::encode(const Message& message, double rate) {
  const std::size_t size = message.raw.size();
  if (size < kBytesMin || size > kBytesMax) return std::nullopt;
  const double cost = kSeconds + kSecondsPerByte * static_cast<double>(size);
  if (how_.automatic && !gain_.pays(size, rate, cost)) return std::nullopt;
  Base* base = base_of(message);
  const Codec codec = codec_for(message, base);
  auto body = compressed(message, codec, base);
  // The deltas after a base shrink more than the base itself, so a base's own ratio is not noted as
  // a bad result.
  const double ratio = body ? static_cast<double>(body->size()) / static_cast<double>(size) : 1;
  if (!body || codec != Codec::kZstdBase || ratio < gain_.ratio()) gain_.note(ratio);
  // A message that does not shrink alone may shrink against the last base, which is still valid.
  if (!body && base) base->deltas = 0;
  if (!body) return std::nullopt;
  const std::uint64_t room = makes_base(codec) ? size + kBaseOverheadBytes : 0;
  return Body{codec, Payload::adopt(*std::move(body)), budget_.hold(room)};
}

std::optional<Bytes> DeltaEncoder::compressed(const Message& message, Codec codec,
                                              const Base* base) const {
  const ByteView raw = message.raw.view();
  if (codec == Codec::kZstd) return compress(raw, {Codec::kZstd, how_.level});
  const bool refers = codec == Codec::kZstdDelta;
  return compress_delta(raw, refers ? base->raw.view() : ByteView{}, how_.level);
}

void DeltaEncoder::sent(const Message& message, Codec codec, Budget::Hold room) {
  // Sent whole, so the peer has it, or will have it before what is encoded next.
  if (!makes_base(codec)) return;
  Base& base = bases_[message.subject.value];
  base.deltas = codec == Codec::kZstdDelta ? base.deltas + 1 : 0;
  base.demand = message.demand;
  base.raw = message.raw;
  base.bytes = std::move(room);
}

}  // namespace connect_bridge
