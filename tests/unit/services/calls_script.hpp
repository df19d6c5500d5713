// Sides that are attached to a service, or let a peer attach: where tests of calls begin.
#pragma once

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {

// The peer on connection 1 is attached to /s (channel 1, requests 1, client 1).
inline void attached(Script& s) {
  s.graph({}, {service("/s")});
  s.join(1);
  s.say(1, Attach{{1}, {1}});
  s.give(ServiceReady{{1}, true, "hash"});
  s.did();
  s.said(1);
}

inline void answer(Script& s, std::uint32_t invocation, const std::string& text) {
  s.give(ResponseTaken{{1}, {invocation}, sample(text)});
}

inline constexpr std::int64_t kDiscovered = 500;  // no mirror before

// The peer on connection 1 offers /s on channel 1; the side is attached, and mirror 1 exists.
inline void mirrored(Script& s) {
  s.graph({});
  s.join(1);
  s.pass(kDiscovered);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  s.say(1, Attached{{1}, {1}, {0}, {}, "hash"});
  s.did();
  s.said(1);
}

inline void request(Script& s, std::uint32_t id, const std::string& text) {
  s.give(RequestTaken{{1}, {id}, sample(text)});
}

inline ServiceStatus first(const Script& s) {
  return s.status().links.at(0).services.at(0);
}

}  // namespace connect_bridge::side_test
