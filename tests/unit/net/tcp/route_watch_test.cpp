#include "net/tcp/route_watch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "unit/net/tcp/own_network.hpp"
#include "unit/net/websocket/harness.hpp"

namespace connect_bridge::test {
namespace {

// A client in a network of its own, which nobody answers.
struct Unanswered {
  Loop loop;
  std::size_t failures = 0;
  std::vector<bool> changes;  // whether the route was another one
  Network network{loop.io,
                  {[this](Input&& input) {
                     if (std::holds_alternative<DialFailed>(input)) ++failures;
                     if (const auto* changed = std::get_if<NetworkChanged>(&input))
                       changes.push_back(changed->route);
                   },
                   [](ConnectionId, const Repairs&) { return std::optional<Packet>{}; },
                   {},
                   {}}};

  void dial(const std::string& host) {
    DialOptions options;
    options.url = {false, host, 9, "/"};
    network.dial(kDial, options);
    EXPECT_TRUE(loop.until([this] { return failures > 0; }));
  }
  // The kernel may have more to report than the change at hand.
  void expect_change(bool of_route) {
    changes.clear();
    EXPECT_TRUE(loop.until([&] { return !changes.empty() && changes.back() == of_route; }));
    EXPECT_EQ(std::count(changes.begin(), changes.end(), true), of_route ? 1 : 0);
  }
};

TEST(RouteWatch, WhatDoesNotConcernAServerThatNeverAnsweredIsNoChange) {
  const bool allowed = in_own_network([] {
    set_up("lo");
    Unanswered client;
    client.dial("127.0.0.1");
    give_address("lo:1", "10.0.0.1");  // as when a container starts
    client.expect_change(false);
    set_up("lo", false);
    client.expect_change(true);
  });
  if (!allowed) GTEST_SKIP() << "this machine does not allow network namespaces";
}

}  // namespace
}  // namespace connect_bridge::test
