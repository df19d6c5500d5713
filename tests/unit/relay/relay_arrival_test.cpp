#include "relay/relay_arrival.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/net/websocket/harness.hpp"
#include "unit/relay/ticket_hello.hpp"

namespace connect_bridge::test {
namespace {

// A connection that arrives, and the one who has dialled.
struct Arriving {
  explicit Arriving(bool from_proxy)
      : acceptor(loop.io, {asio::ip::make_address("127.0.0.1"), 0}),
        dialled(acceptor.local_endpoint().port()),
        arrival(std::make_shared<RelayArrival>(accepted())) {
    arrival->read(from_proxy, arrival,
                  {[this](const Source& source) { from.push_back(source.address.to_string()); },
                   [this](RelayArrival::State state) { states.push_back(state); }});
  }
  TcpSocket accepted() {
    TcpSocket socket(loop.io.get_executor());
    acceptor.accept(socket);
    return socket;
  }
  bool ends_as(RelayArrival::State state) {
    loop.until([this] { return !states.empty(); });
    return states == std::vector<RelayArrival::State>{state};
  }

  Loop loop;
  asio::ip::tcp::acceptor acceptor;
  RawPeer dialled;
  std::shared_ptr<RelayArrival> arrival;
  std::vector<std::string> from;
  std::vector<RelayArrival::State> states;
};

TEST(RelayArrival, ReadsTheHelloAndNoByteMore) {
  const std::string hello = ticket_hello("robot7", std::string(64, '0'));
  for (const std::string header : {"", "PROXY TCP4 203.0.113.7 192.0.2.1 4711 443\r\n"}) {
    Arriving at(!header.empty());
    at.dialled.send(header + hello + "more");
    ASSERT_TRUE(at.ends_as(RelayArrival::State::kHello)) << header;
    EXPECT_EQ(at.arrival->hello().server_name, "robot7");
    EXPECT_EQ(std::string(at.arrival->bytes().begin(), at.arrival->bytes().end()), hello);
    EXPECT_EQ(at.arrival->socket().available(), 4U);
    EXPECT_EQ(at.from.size(), header.empty() ? 0U : 1U);
  }
}

TEST(RelayArrival, TellsWhatIsWrongFromWhatSaysNothing) {
  Arriving silent(false), half(false), none(false), unheard(true);
  silent.dialled.half_close();
  EXPECT_TRUE(silent.ends_as(RelayArrival::State::kNothing));
  half.dialled.send("\x16\x03");
  half.dialled.half_close();
  EXPECT_TRUE(half.ends_as(RelayArrival::State::kWrong));
  none.dialled.send("GET / HTTP/1.1\r\n");
  EXPECT_TRUE(none.ends_as(RelayArrival::State::kWrong));
  unheard.dialled.send(ticket_hello("robot7", std::string(64, '0')));
  EXPECT_TRUE(unheard.ends_as(RelayArrival::State::kWrong));
}

}  // namespace
}  // namespace connect_bridge::test
