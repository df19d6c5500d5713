#include "core/flow/delta_decoder.hpp"

#include <utility>

#include "core/compress/compress.hpp"

namespace connect_bridge {

Result<std::optional<Payload>> DeltaDecoder::decode(const InMessage& message, bool wanted) {
  Payload base;
  if (message.codec == Codec::kZstdDelta) {
    const auto known = bases_.find(message.subject.value);
    // Without any base before it the peer is wrong. With an empty one this side did not want it,
    // for the sake of its own limits: then what refers to it is dropped too, until the origin's
    // next kZstdBase.
    if (known == bases_.end())
      return Error{CloseCode::kMalformed, "a message refers to a base that was not sent"};
    base = known->second.raw;
    wanted = wanted && !base.empty();
  }
  if (!wanted) return keep(message.subject, std::nullopt);
  auto raw = decompress_delta(message.body.view(), base.view(), message.raw_bytes);
  if (!raw) return raw.error();
  return keep(message.subject, Payload::adopt(std::move(raw).value()));
}

Result<std::optional<Payload>> DeltaDecoder::keep(Subject origin, std::optional<Payload> raw) {
  Base& base = bases_[origin.value];
  base.raw = raw.value_or(Payload{});
  base.bytes.release();
  base.bytes = budget_.hold(base.raw.size() + kBaseOverheadBytes);
  // The sender counts in the same way (DeltaEncoder::codec_for), so one that keeps to the protocol
  // does not come here.
  if (budget_.used() > kBasesBytesMax)  // mutant: bases_bound
    return Error{CloseCode::kTooLarge, "more bases than a link may have"};
  return raw;
}

}  // namespace connect_bridge
