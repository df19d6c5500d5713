// A side with a mirror that is fed.
#pragma once

#include <gtest/gtest.h>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {

// Link 1 has offered /map of publisher 11, demanded by a local subscriber through mirror 2.
struct Mirrors : Script {
  explicit Mirrors(const Qos& q = latched(), SideOptions options = server())
      : Script(std::move(options)) {
    graph({topic("/map").sub(1)});
    pass(1000);
    session = join(1);
    say(1, Offer{{channel(1, "/map", {origin(1, 11, q)})}, true});
    EXPECT_EQ(said(1), "demand 1 on\n");
    did();
  }
  Token128 session;
};

}  // namespace connect_bridge::side_test
