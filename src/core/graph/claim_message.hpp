// A claim as a message: what a bridge publishes for the other bridges of its graph.
#pragma once

#include <optional>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

struct Claim {
  Token128 side;
  std::vector<Gid> origins;
};

// The claim as a serialized rcl_interfaces/msg/Log (a type that every ROS 2 has); the text is in
// `msg`.
Payload serialize(const Claim& claim, Stamp stamp);
// nullopt: not a claim of this version.
std::optional<Claim> parse_claim(ByteView cdr);

}  // namespace connect_bridge
