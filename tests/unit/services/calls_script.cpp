#include "unit/services/calls_script.hpp"

namespace connect_bridge::side_test {

void attached(Script& s) {
  s.graph({}, {service("/s")});
  s.join(1);
  s.say(1, Attach{{1}, {1}});
  s.give(ServiceReady{{1}, true, "hash"});
  s.did();
  s.said(1);
}

void answer(Script& s, std::uint32_t invocation, const std::string& text) {
  s.give(ResponseTaken{{1}, {invocation}, sample(text)});
}

void mirrored(Script& s) {
  s.graph({});
  s.join(1);
  s.pass(kDiscovered);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  s.say(1, Attached{{1}, {1}, {0}, {}, "hash"});
  s.did();
  s.said(1);
}

void request(Script& s, std::uint32_t id, const std::string& text) {
  s.give(RequestTaken{{1}, {id}, sample(text)});
}

ServiceStatus first(const Script& s) {
  return s.status().links.at(0).services.at(0);
}

}  // namespace connect_bridge::side_test
