#include "core/flow/delta_decoder.hpp"

#include <utility>

#include "core/compress/compress.hpp"

namespace connect_bridge {

Result<std::optional<Payload>> DeltaDecoder::decode(const InMessage& message, bool wanted) {
  Payload base;
  if (message.codec == Codec::kZstdDelta) {
    const auto known = bases_.find(message.subject.value);
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
  if (budget_.used() > kBasesBytesMax)
    return Error{CloseCode::kTooLarge, "more bases than a link may have"};
  return raw;
}

}  // namespace connect_bridge
