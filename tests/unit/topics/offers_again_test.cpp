// A topic that is withdrawn from a peer, as something has changed, and offered again.
#include <gtest/gtest.h>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

// A killed process stays in the graph while its successor has another definition of the type.
TEST(OffersAgain, ATypeWithAnotherDefinitionIsOfferedAgain) {
  const auto of_type = [](const std::string& hash) {
    auto seen = topic("/a").pub(1);
    seen.type_hash = hash;
    return seen;
  };
  Script s(server());
  s.graph({of_type("RIHS01_1")});
  s.join(1);
  s.demand(1, 1);
  s.said(1);
  s.did();
  s.graph({of_type("")});  // its last publisher has just ended, for example
  EXPECT_EQ(s.said(1), "");
  auto listened = topic("/a").sub(9);  // with another definition, and nobody publishes
  listened.type_hash = "RIHS01_2";
  s.graph({listened});
  EXPECT_EQ(s.said(1), "");
  s.graph({of_type("RIHS01_2").pub(2)});
  EXPECT_EQ(s.said(1), "withdraw 1\noffer 2/a[1 2]\n");
  s.demand(1, 2);
  EXPECT_EQ(s.did(), "unsubscribe 2\nsubscribe 3 /a reliable volatile 100\n");
}

// The peer's rules were changed and changed back before its first list was compared.
TEST(OffersAgain, WhatWasDeclinedUnderAnotherListIsOfferedAgain) {
  Script s(server());
  s.graph({topic("/a").pub(1)});
  s.join(1);
  s.demand(1, 1);
  s.said(1);
  s.say(1, Accepts{{{{"/b"}, {}}}, {}});
  s.say(1, Decline{{1}, "not_permitted", ""});
  s.say(1, Accepts{{{{"/**"}, {}}}, {}});
  s.pass(1000);
  EXPECT_EQ(s.said(1), "withdraw 1\noffer 2/a[1]\n");
  s.demand(1, 2);  // what is demanded goes on
  s.say(1, Decline{{2}, "limit", ""});
  s.give(PolicyChanged{Policy({everything()})});  // the peer's list is the same
  s.pass(1000);
  EXPECT_EQ(s.said(1).find("offer"), std::string::npos);
}

}  // namespace
}  // namespace connect_bridge::side_test
