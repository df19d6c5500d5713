// A claim as a message: what a bridge publishes for the other bridges of its graph
// (docs/protocol.md, "Bridges of one graph").
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

// A claim names no more, so that its message is no larger than this.
inline constexpr std::size_t kClaimOriginsMax = 65536;
inline constexpr std::size_t kClaimPeersMax = 256;
inline constexpr std::size_t kClaimBytesMax = 256 + 34 * kClaimPeersMax + 100 * kClaimOriginsMax;

// For how long a claim may say that it is good.
inline constexpr Duration kClaimGoodMax = std::chrono::hours(1);

struct ClaimedOrigin {
  Gid gid;
  bool feeds = false;  // its mirror has settled: who has not gives way

  friend bool operator==(const ClaimedOrigin&, const ClaimedOrigin&) = default;
};

struct Claim {
  Token128 side;
  std::vector<ClaimedOrigin> origins;
  std::vector<Gid> mirrors = {};     // ids in this graph of its own publishers
  std::vector<Token128> peers = {};  // the sides at the other ends of its links
  // Without another message it is good for so long: whole milliseconds, up to kClaimGoodMax.
  // Longer, so also kForever: for ever.
  Duration good_for = kForever;

  friend bool operator==(const Claim&, const Claim&) = default;
};

// The claim as a serialized rcl_interfaces/msg/Log (a type that every ROS 2 has); the text is in
// `msg`.
Payload serialize(const Claim& claim, Stamp stamp);
// nullopt: not a claim of this version.
std::optional<Claim> parse_claim(ByteView cdr);

}  // namespace connect_bridge
