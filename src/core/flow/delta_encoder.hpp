// Encodes small messages as their difference to the message before.
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
  // After so many deltas of an origin a message is sent without reference to a base, so that a
  // receiver that had to skip one can go on.
  static constexpr std::uint32_t kDeltasMax = 128;

  // A message to be sent on the channel.
  struct Message {
    Subject subject;
    std::uint16_t demand = 0;
    Payload raw;
  };
  struct Body {
    Codec codec = Codec::kNone;
    Payload bytes;
    // Budget for the base that this message will be; bases that are being sent on several channels
    // count as well.
    Budget::Hold room;
  };

  // `bases`: of the link, outlives this. Without `has_origins` each message is encoded on its own.
  DeltaEncoder(Compression how, bool has_origins, Budget& bases)
      : how_(how), has_origins_(has_origins), budget_(bases) {}

  // The body to send for the message now, on a path that carries `rate` bytes per second
  // (0: not known); nullopt: send it unchanged.
  std::optional<Body> encode(const Message& message, double rate);
  // The message has been sent completely, in this codec; `room`: that of its Body.
  void sent(const Message& message, Codec codec, Budget::Hold room);
  // The origin is gone.
  void forget(Subject origin) { bases_.erase(origin.value); }
  // The demand or the connection has ended: the peer has no base.
  void clear() { bases_.clear(); }

 private:
  struct Base {
    std::uint16_t demand = 0;
    Payload raw;
    std::uint32_t deltas = 0;  // since the last message without a reference
    Budget::Hold bytes;
  };
  // The base that the peer has for this demand; null if none.
  [[nodiscard]] Base* base_of(const Message& message);
  // How the message is encoded; `base`: null if there is none.
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
