// A service that is withdrawn from a peer, as something has changed, and offered again.
#include <gtest/gtest.h>

#include "unit/services/calls_script.hpp"

namespace connect_bridge::side_test {
namespace {

// The peer's rules were changed and changed back before its first list was compared.
TEST(ServiceOffersAgain, WhatWasDeclinedUnderAnotherListIsOfferedAgain) {
  Script s(server({callable()}));
  s.graph({}, {service("/s", {1})});
  s.join(1);
  s.say(1, Accepts{});
  s.say(1, Decline{{1}, "not_permitted", ""});
  s.say(1, Accepts{{{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}}}, {}});
  s.pass(1000);
  EXPECT_EQ(s.said(1), "withdraw 1\noffer 2/s[]\n");
}

// The peer's rules allow another definition of the type now: it attaches to what it had declined.
TEST(ServiceOffersAgain, AttachedAfterADeclineItOutlivesTheNextList) {
  Script s(server({callable()}));
  s.graph({}, {service("/s", {1})});
  s.join(1);
  s.say(1, Decline{{1}, "type_mismatch", ""});
  s.say(1, Attach{{1}, {1}});
  s.give(ServiceReady{{1}, true, {}});
  s.said(1);
  s.say(1, Accepts{{{{"/**"}, {}, {"/s"}, {"/**"}, {"/**"}}}, {}});
  s.pass(1000);
  EXPECT_EQ(s.said(1).find("withdraw"), std::string::npos);
}

}  // namespace
}  // namespace connect_bridge::side_test
