// The message in which a bridge publishes its claim for the other bridges of its graph
// (docs/protocol.md, "Bridges of one graph").
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

// Limits of a claim: so many origins and services together, and as many mirrors. They bound the
// size of its message.
inline constexpr std::size_t kClaimOriginsMax = 65536;
inline constexpr std::size_t kClaimBytesMax = 256 + 100 * kClaimOriginsMax;

// The longest time that a claim may state for itself.
inline constexpr Duration kClaimGoodMax = std::chrono::hours(1);
// The time of a claim that states none.
inline constexpr Duration kClaimGoodDefault = std::chrono::seconds(10);

struct Claim {
  Token128 side;
  std::vector<Gid> origins = {};  // origins that have a mirror, or will have one
  std::vector<Gid> mirrors = {};  // ids of the bridge's own publishers in this graph
  // Services (service_gid) that have a mirror, or will have one. They have a list of their own:
  // peers choose the ids of origins, and no such id may stand for a service.
  std::vector<Gid> services = {};
  // The claim expires after this time without another message: whole milliseconds, up to
  // kClaimGoodMax. Longer values mean: not stated (in a message), or never.
  Duration good_for = kForever;

  friend bool operator==(const Claim&, const Claim&) = default;
};

// Upper bound of the size of the claim's message.
[[nodiscard]] std::size_t claim_bytes(const Claim& claim);

// Serializes the claim as rcl_interfaces/msg/Log, a type of every ROS 2 installation. The text is
// in `msg`.
Payload serialize(const Claim& claim, Stamp stamp);
// Parses such a message. nullopt: not a claim of this version.
std::optional<Claim> parse_claim(ByteView cdr);

}  // namespace connect_bridge
