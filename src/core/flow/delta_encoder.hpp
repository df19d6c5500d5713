// Small messages leave as what is new in them, against the one before.
#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>

#include "core/base/budget.hpp"
#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/flow/compression_gain.hpp"
#include "core/wire/codec.hpp"

namespace connect_bridge {

// Belongs to the queue of one channel. The peer has whatever was sent whole before on the same
// connection, so a base is what was sent(), and a message is encoded at the last moment: what is
// dropped before that changes nothing. Single-threaded.
class DeltaEncoder {
 public:
  // Larger messages are not worth the loop's time: a worker compresses them. (16 KiB: 0.2 ms.)
  static constexpr std::size_t kBytesMin = 128;
  static constexpr std::size_t kBytesMax = 16 << 10;
  // After so many messages of an origin one refers to nothing, so that a receiver that had to leave
  // one out gets on.
  static constexpr std::uint32_t kDeltasMax = 128;

  // What is sent on the channel.
  struct Message {
    Subject subject;
    std::uint16_t demand = 0;
    Payload raw;
  };
  struct Body {
    Codec codec = Codec::kNone;
    Payload bytes;
    // Of the base that the message will be: what is under way on several channels counts, too.
    Budget::Hold room;
  };

  // `bases`: of the link, outlives this. `has_origins`: else each message stands for itself.
  DeltaEncoder(Compression how, bool has_origins, Budget& bases)
      : how_(how), has_origins_(has_origins), budget_(bases) {}

  // The body with which the message is to leave now, on a path that carries `rate` bytes per second
  // (0: not known); nullopt: as it is.
  std::optional<Body> encode(const Message& message, double rate);
  // A message has left whole, in this codec; `room`: of its body.
  void sent(const Message& message, Codec codec, Budget::Hold room);
  // The origin is gone.
  void forget(Subject origin) { bases_.erase(origin.value); }
  // Demand or connection have ended.
  void clear() { bases_.clear(); }

 private:
  struct Base {
    std::uint16_t demand = 0;
    Payload raw;
    std::uint32_t deltas = 0;  // since one referred to nothing
    Budget::Hold bytes;
  };
  // The one that the peer has for this demand.
  [[nodiscard]] Base* base_of(const Message& message);
  // How the message goes; `base`: null if it has none.
  [[nodiscard]] Codec codec_for(const Message& message, const Base* base) const;
  [[nodiscard]] std::optional<Bytes> compressed(const Message& message, Codec codec,
                                                const Base* base) const;

  Compression how_;
  bool has_origins_;
  Budget& budget_;
  CompressionGain gain_;
  std::unordered_map<std::uint32_t, Base> bases_;  // by origin
};

}  // namespace connect_bridge
