// Several addresses of one name. A black hole is a listener whose queue is full: the kernel drops
// what else would connect, as a firewall does.
#include "net/tcp/race.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/net/websocket/harness.hpp"

namespace connect_bridge::test {
namespace {

using asio::ip::tcp;
using testing::ElementsAre;
using Clock = std::chrono::steady_clock;

class BlackHole {
 public:
  BlackHole(Loop& loop, const tcp::endpoint& address) : acceptor_(loop.io), filling_(loop.io) {
    acceptor_.open(address.protocol());
    acceptor_.bind(address);
    acceptor_.listen(0);
    filling_.connect(acceptor_.local_endpoint());
  }
  [[nodiscard]] tcp::endpoint address() const { return acceptor_.local_endpoint(); }
  void opens() {
    acceptor_.accept();
    acceptor_.listen(8);
  }

 private:
  tcp::acceptor acceptor_;
  tcp::socket filling_;
};

tcp::endpoint loopback(std::uint16_t port) {
  return {asio::ip::address_v4::loopback(), port};
}

struct Racing {
  Racing(Loop& loop, const std::vector<tcp::endpoint>& addresses)
      : begun(Clock::now()), race(std::make_shared<Race>(loop.io)) {
    race->start(addresses, [this](auto connected, const ErrorCode& failed) {
      socket = std::move(connected);
      error = failed;
      took = Clock::now() - begun;
      ++ends;
    });
  }
  ~Racing() { race->stop(); }

  const Clock::time_point begun;
  std::optional<TcpSocket> socket;
  ErrorCode error;
  Clock::duration took{};
  int ends = 0;
  std::shared_ptr<Race> race;
};

TEST(Race, AnAddressThatIsSilentCostsAQuarterOfASecond) {
  Loop loop;
  BlackHole hole{loop, loopback(0)};
  tcp::acceptor good{loop.io, loopback(0)};
  Racing racing{loop, {hole.address(), good.local_endpoint()}};
  ASSERT_TRUE(loop.until([&] { return racing.ends > 0; }, 900ms)) << "less than an attempt's time";
  ASSERT_TRUE(racing.socket);
  EXPECT_EQ(racing.socket->remote_endpoint(), good.local_endpoint());
  EXPECT_GE(racing.took, Race::kAttemptDelay);
  loop.run_for(1500ms);
  EXPECT_EQ(racing.ends, 1);
}

TEST(Race, AnAddressThatRefusesCostsNothing) {
  Loop loop;
  tcp::acceptor good{loop.io, loopback(0)};
  Racing racing{loop, {loopback(1), loopback(2), good.local_endpoint()}};
  ASSERT_TRUE(loop.until([&] { return racing.ends > 0; }));
  EXPECT_TRUE(racing.socket);
  EXPECT_LT(racing.took, Race::kAttemptDelay);
}

TEST(Race, EndsWhenAllRefuse) {
  Loop loop;
  Racing racing{loop, {loopback(1), loopback(2)}};
  ASSERT_TRUE(loop.until([&] { return racing.ends > 0; }));
  EXPECT_FALSE(racing.socket);
  EXPECT_EQ(racing.error, asio::error::connection_refused);
}

// An attempt that was lost is repeated long before the kernel would repeat it.
TEST(Race, ASilentAddressIsTriedAgain) {
  Loop loop;
  BlackHole hole{loop, loopback(0)};
  Racing racing{loop, {hole.address(), loopback(1)}};
  loop.run_for(300ms);
  EXPECT_EQ(racing.ends, 0) << "one refuses, the other may still answer";
  hole.opens();
  ASSERT_TRUE(loop.until([&] { return racing.ends > 0; }));
  EXPECT_TRUE(racing.socket);
}

// Its first attempt waits for the kernel, which has long intervals; a path may be back at any time.
TEST(Race, ASilentAddressIsTriedAgainAndAgain) {
  Loop loop;
  BlackHole hole{loop, loopback(0)};
  Racing racing{loop, {hole.address()}};
  loop.run_for(2200ms);
  EXPECT_EQ(racing.ends, 0);
  const auto opened = Clock::now();
  hole.opens();
  ASSERT_TRUE(loop.until([&] { return racing.ends > 0; }));
  ASSERT_TRUE(racing.socket);
  // The kernel would be back 3 s after the beginning.
  EXPECT_LT(Clock::now() - opened, 700ms);
}

TEST(Race, OneRefusalEndsAllAttemptsAtAnAddress) {
  Loop loop;
  std::optional<BlackHole> hole(std::in_place, loop, loopback(0));
  Racing racing{loop, {hole->address()}};
  loop.run_for(1600ms);
  EXPECT_EQ(racing.ends, 0);
  hole.reset();
  ASSERT_TRUE(loop.until([&] { return racing.ends > 0; }));
  EXPECT_EQ(racing.error, asio::error::connection_refused);
  loop.run_for(600ms);
  EXPECT_EQ(racing.ends, 1);
}

TEST(Race, WhoHasLostIsClosed) {
  Loop loop;
  tcp::acceptor first{loop.io, loopback(0)};
  BlackHole hole{loop, loopback(0)};
  Racing racing{loop, {hole.address(), first.local_endpoint()}};
  ASSERT_TRUE(loop.until([&] { return racing.ends > 0; }));
  ASSERT_TRUE(racing.socket);
  racing.socket.reset();
  loop.io.restart();
  loop.io.run_for(100ms);
  EXPECT_TRUE(loop.io.stopped()) << "nothing is under way any more";
}

TEST(Race, IsStoppedWithoutAWord) {
  Loop loop;
  tcp::acceptor good{loop.io, loopback(0)};
  Racing racing{loop, {good.local_endpoint()}};
  racing.race->stop();
  loop.run_for(50ms);
  EXPECT_EQ(racing.ends, 0);
}

TEST(Race, FamiliesTakeTurns) {
  const auto address = [](const char* text) {
    return tcp::endpoint{asio::ip::make_address(text), 9};
  };
  const auto a = address("2001:db8::1"), b = address("2001:db8::2"), c = address("2001:db8::3");
  const auto x = address("192.0.2.1"), y = address("192.0.2.2");
  EXPECT_THAT(Race::in_turns({a, b, c, x, y}), ElementsAre(a, x, b, y, c));
  EXPECT_THAT(Race::in_turns({x, a, b, c}), ElementsAre(x, a, b, c));
  EXPECT_THAT(Race::in_turns({}), ElementsAre());
  std::vector<tcp::endpoint> many(100, a);
  many.push_back(x);
  const auto some = Race::in_turns(many);
  EXPECT_EQ(some.size(), Race::kAddressesMax);
  EXPECT_EQ(some[1], x);
}

}  // namespace
}  // namespace connect_bridge::test
