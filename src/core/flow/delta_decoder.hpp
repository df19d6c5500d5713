// Decodes messages that were encoded against the message before them (deltas).
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "core/base/budget.hpp"
#include "core/base/bytes.hpp"
#include "core/base/result.hpp"
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
  Result<std::optional<Payload>> decode(const InMessage& message, bool wanted);
  void forget(Subject origin) { bases_.erase(origin.value); }
  void clear() { bases_.clear(); }

 private:
  struct Base {
    Payload raw;  // empty: it was not wanted
    Budget::Hold bytes;
  };
  Result<std::optional<Payload>> keep(Subject origin, std::optional<Payload> raw);

  Budget& budget_;
  std::map<std::uint32_t, Base> bases_;  // by origin; not hashed: the peer chooses the numbers
};

}  // namespace connect_bridge
