// Decodes messages that were encoded against the message before them (deltas).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "core/base/budget.hpp"
#include "core/base/bytes.hpp"
#include "core/base/result.hpp"
#include "core/compress/compress.hpp"
#include "core/flow/reassembly.hpp"
#include "core/wire/codec.hpp"

namespace connect_bridge {

// Belongs to one channel on which a peer sends; keeps the base of each origin, within the budget of
// the link. All messages of kZstdBase and kZstdDelta go through it in the order of their arrival.
// Single-threaded.
class DeltaDecoder {
 public:
  // `bases`: of the link, outlives this.
  explicit DeltaDecoder(Budget& bases) : budget_(bases) {}

  // The raw message, which is its origin's base from now on. nullopt: it is not `wanted` (a limit),
  // or its base was not. kMalformed: damaged, or without a base; kTooLarge: more bases than a link
  // may have.
  Result<std::optional<Payload>> decode(const InMessage& message, bool wanted) {
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
  void forget(Subject origin) { bases_.erase(origin.value); }
  void clear() { bases_.clear(); }

 private:
  struct Base {
    Payload raw;  // empty: it was not wanted
    Budget::Hold bytes;
  };
  Result<std::optional<Payload>> keep(Subject origin, std::optional<Payload> raw) {
    Base& base = bases_[origin.value];
    base.raw = raw.value_or(Payload{});
    base.bytes.release();
    base.bytes = budget_.hold(base.raw.size() + kBaseOverheadBytes);
    // The sender counts in the same way (DeltaEncoder::codec_for), so one that keeps to the
    // protocol does not come here.
    if (budget_.used() > kBasesBytesMax)  // mutant: bases_bound
      return Error{CloseCode::kTooLarge, "more bases than a link may have"};
    return raw;
  }

  Budget& budget_;
  std::map<std::uint32_t, Base> bases_;  // by origin; not hashed: the peer chooses the numbers
};

}  // namespace connect_bridge
