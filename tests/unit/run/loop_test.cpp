#include "run/loop.hpp"

#include <gtest/gtest.h>

#include <boost/asio/post.hpp>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/wire/login.hpp"

namespace connect_bridge::test {
namespace {

using namespace std::chrono_literals;

SideOptions server() {
  SideOptions options;
  options.node = "/own";
  return options;
}

Token128 peer(std::uint8_t n) {
  Token128 id;
  id.bytes.fill(n);
  return id;
}

// A server whose packets cost what the test says.
struct LoopScene {
  LoopScene() { loop.feed(TimePassed{}); }

  void log_in(std::uint32_t connection, const std::string& who) {
    Identity identity;
    identity.name = who;
    loop.feed(ConnectionOpened{{connection}, who});
    give(connection, encode(Hello{1, 1, peer(static_cast<std::uint8_t>(connection)), {}, "/peer"}));
    give(connection, encode(Login{"none", {}}));
    loop.feed(Authenticated{{connection}, identity, ""});
    done = 0;
    end_with_a_short_step();
  }
  // On any machine, however busy.
  void end_with_a_short_step() {
    do {
      static_cast<void>(loop.take_longest());
      loop.step([](const auto&) { return 0; });
    } while (loop.take_longest() > 100us);
  }
  void give(std::uint32_t connection, const Bytes& packet) {
    loop.feed(PacketReceived{{connection}, false, Payload::copy_of(packet)});
  }
  // A packet was handled.
  void read_on(ConnectionId connection) {
    read.push_back(connection.value);
    side.spent(cost, loop.now().steady);
    if (then) std::exchange(then, nullptr)();
    end_with_a_short_step();
  }
  bool act() {
    ++done;
    if (slow) std::this_thread::sleep_for(2ms);
    return true;
  }
  // The number of looks until something is read; -1: nothing is. A handler that posts itself again
  // runs between two looks, as a socket's would.
  int looks() {
    const auto before = read.size();
    int between = 0;
    bool runs = true;
    std::function<void()> socket = [&] {
      runs = read.size() == before && ++between < 100;
      if (runs) boost::asio::post(io, socket);
    };
    boost::asio::post(io, socket);
    while (runs) io.poll_one();
    return read.size() == before ? -1 : between + 1;
  }

  boost::asio::io_context io{1};
  Side side{server(), 1, 0};
  bool alone = false;
  bool slow = false;           // the middleware waits
  int done = 0;                // actions
  Duration cost{};             // of each packet
  std::function<void()> then;  // in the step of the next packet
  std::vector<std::uint32_t> read;
  Loop loop{io,
            side,
            {[] { return Stamp{0}; }, [this](Action&&) { return act(); }, [this] { return alone; },
             [this](ConnectionId connection) { read_on(connection); }, [] {}}};
};

using Order = std::vector<std::uint32_t>;

PacketReceived packet(std::uint32_t connection) {
  return {{connection}, false, {}};
}

TEST(Loop, TheOnlyConnectionIsReadAtOnce) {
  LoopScene s;
  s.log_in(1, "busy");
  s.alone = true;
  s.loop.arrived(packet(1));
  EXPECT_EQ(s.read, (Order{1}));
  EXPECT_EQ(s.looks(), -1);
}

TEST(Loop, BesideAnotherConnectionAPacketWaitsForALook) {
  LoopScene s;
  s.log_in(1, "busy");
  s.log_in(2, "calm");
  s.loop.arrived(packet(1));
  EXPECT_EQ(s.read, Order{});
  EXPECT_EQ(s.looks(), 1);
  EXPECT_EQ(s.looks(), -1);
}

TEST(Loop, WhoHasUsedLessComesFirstAndEachAfterALook) {
  LoopScene s;
  s.log_in(1, "busy");
  s.log_in(2, "calm");
  s.cost = 10ms;
  s.loop.arrived(packet(1));
  EXPECT_EQ(s.looks(), 1);
  s.loop.arrived(packet(1));
  s.loop.arrived(packet(2));  // while the loop looks at the sockets
  EXPECT_EQ(s.looks(), 1);
  EXPECT_EQ(s.looks(), 1);
  EXPECT_EQ(s.read, (Order{1, 2, 1}));
  EXPECT_EQ(s.looks(), -1);
}

TEST(Loop, WhoComesWhileThereIsOneConnectionWaitsForItsStepAlone) {
  LoopScene s;
  s.log_in(1, "busy");
  s.alone = true;
  s.cost = 10ms;
  s.then = [&s] {
    s.alone = false;
    s.log_in(2, "calm");
  };
  s.loop.arrived(packet(1));
  s.loop.arrived(packet(1));
  s.loop.arrived(packet(2));
  EXPECT_EQ(s.looks(), 1);
  EXPECT_EQ(s.looks(), 1);
  EXPECT_EQ(s.read, (Order{1, 2, 1}));
}

TEST(Loop, AfterALongStepAPacketWaitsForManyLooks) {
  LoopScene s;
  s.log_in(1, "busy");
  s.log_in(2, "calm");
  s.slow = true;
  s.loop.feed(StopRequested{});  // it has actions
  ASSERT_GT(s.done, 0);
  s.loop.arrived(packet(1));
  EXPECT_EQ(s.looks(), 8);
}

// Looks do not help against a machine that is busy with others. Some of its time may count as ours.
TEST(Loop, AStepIsNotLongBecauseOthersComputed) {
  LoopScene s;
  s.log_in(1, "busy");
  s.log_in(2, "calm");
  int looks = 8;
  for (int i = 0; i < 10 && looks > 1; ++i) {
    s.loop.step([](const auto& handle) {
      std::this_thread::sleep_for(2ms);  // as long as others compute
      handle(TimePassed{});
      return 0;
    });
    s.loop.arrived(packet(1));
    looks = s.looks();
  }
  EXPECT_EQ(looks, 1);
}

}  // namespace
}  // namespace connect_bridge::test
