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

// A claim names no more (origins and services together, and as many mirrors), so that its message
// is no larger than this.
inline constexpr std::size_t kClaimOriginsMax = 65536;
inline constexpr std::size_t kClaimBytesMax = 256 + 100 * kClaimOriginsMax;

// For how long a claim may say that it is good.
inline constexpr Duration kClaimGoodMax = std::chrono::hours(1);
// Where it does not say so.
inline constexpr Duration kClaimGoodUntold = std::chrono::seconds(10);

struct Claim {
  Token128 side;
  std::vector<Gid> origins = {};  // that have a mirror, or will have one
  std::vector<Gid> mirrors = {};  // ids in this graph of its own publishers
  // Services (service_gid) that have a mirror, or will have one. In a list of their own, because
  // peers choose the ids of origins, and no such id may stand for a service.
  std::vector<Gid> services = {};
  // Without another message it is good for so long: whole milliseconds, up to kClaimGoodMax.
  // Longer: not said (in a message), or for ever.
  Duration good_for = kForever;

  friend bool operator==(const Claim&, const Claim&) = default;
};

// Its message has no more bytes.
[[nodiscard]] std::size_t claim_bytes(const Claim& claim);

// The claim as a serialized rcl_interfaces/msg/Log (a type that every ROS 2 has); the text is in
// `msg`.
Payload serialize(const Claim& claim, Stamp stamp);
// nullopt: not a claim of this version.
std::optional<Claim> parse_claim(ByteView cdr);

}  // namespace connect_bridge
