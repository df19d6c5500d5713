// Sides that are attached to a service, or let a peer attach: where tests of calls begin.
#pragma once

#include <string>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {

// The peer on connection 1 is attached to /s (channel 1, requests 1, client 1).
void attached(Script& s);
void answer(Script& s, std::uint32_t invocation, const std::string& text);

inline constexpr std::int64_t kDiscovered = 1500;  // no mirror before

// The peer on connection 1 offers /s on channel 1; the side is attached, and mirror 1 exists.
void mirrored(Script& s);
void request(Script& s, std::uint32_t id, const std::string& text);

ServiceStatus first(const Script& s);

}  // namespace connect_bridge::side_test
