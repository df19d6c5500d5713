// A server's place at a relay, seen by what passes on its control connection.
#include "net/relay/relay_door.hpp"

#include <gmock/gmock.h>

#include <functional>
#include <memory>
#include <utility>

#include "unit/net/tcp/own_network.hpp"
#include "unit/relay/relay_bed.hpp"

namespace connect_bridge::test {
namespace {

// Leads to a relay, and counts what the first that comes, the control connection, says.
struct CountingWay {
  explicit CountingWay(AtRelay& at)
      : to(at.port()), loop(at.loop), door(at.loop.io, {asio::ip::make_address("127.0.0.1"), 0}) {
    accept();
  }
  ~CountingWay() {
    for (const auto& joint : joints) joint->cut();
  }
  [[nodiscard]] std::uint16_t port() const { return door.local_endpoint().port(); }
  void accept() {
    door.async_accept(loop.io.get_executor(), [this](ErrorCode error, TcpSocket socket) {
      if (error) return;
      TcpSocket there(loop.io.get_executor());
      there.connect({asio::ip::make_address("127.0.0.1"), to});
      const bool first = joints.empty();
      joints.push_back(std::make_shared<Joint>(std::move(socket), std::move(there),
                                               [this, first](bool forth, std::size_t bytes) {
                                                 if (first && forth) said += bytes;
                                               }));
      joints.back()->start({}, [] {});
      accept();
    });
  }

  const std::uint16_t to;
  Loop& loop;
  asio::ip::tcp::acceptor door;
  std::vector<std::shared_ptr<Joint>> joints;
  std::size_t said = 0;  // bytes
};

// Behind a NAT of which the address has changed, that is the first sign. A stranger's is none.
TEST(RelayDoor, AsksWhetherTheRelayIsThereWhenALoginsConnectionEnds) {
  AtRelay at;
  CountingWay way(at);
  Side server(at.loop), client(at.loop);
  server.packet_bytes_max = 0;
  const Authority::Files files = relay_authority().sign("robot7", "DNS:robot7");
  ListenOptions listen;
  listen.port = 0;
  listen.tls = TlsOptions{files.certificate, files.key};
  listen.relay.emplace();
  listen.relay->url = {true, "127.0.0.1", way.port(), "/", "robot7"};
  listen.relay->tls.ca_file = relay_authority().ca;
  listen.relay->token = [] { return std::string{"robot7-token"}; };
  int kept = 0;
  listen.relay->keep = [&] {
    ++kept;
    return std::string{};
  };
  ASSERT_EQ(server.network.listen(listen), "");
  ASSERT_TRUE(at.loop.until([&] { return kept == 1; }));
  ASSERT_EQ(server.network.relays().size(), 1U);
  EXPECT_EQ(server.network.relays().at(0).relay, listen.relay->url.text("ws"));
  EXPECT_GT(server.network.relays().at(0).connected_since, 0);
  EXPECT_EQ(server.network.relays().at(0).failure.text, "");
  DialOptions dial;
  dial.url = {true, "127.0.0.1", at.port(), "/", "robot7"};
  dial.tls.ca_file = relay_authority().ca;
  for (const bool logs_in : {false, true}) {
    const ConnectionId id{logs_in ? 2U : 1U};
    client.network.dial(id, dial);
    ASSERT_TRUE(at.loop.until([&] { return server.opened.size() == id.value; }))
        << client.failures[id];
    const ConnectionId there = server.opened.back();
    if (logs_in) server.network.allow(there, 1 << 20);
    at.loop.run_for(100ms);
    const std::size_t said = way.said;
    client.network.close(id, CloseCode::kGoingAway, "");
    ASSERT_TRUE(at.loop.until([&] { return server.is_closed(there); }));
    EXPECT_EQ(at.loop.until([&] { return way.said > said; }, 500ms), logs_in);
  }
  EXPECT_EQ(kept, 1);
  EXPECT_TRUE(client.network.relays().empty());
  way.joints.front()->cut();
  EXPECT_TRUE(at.loop.until([&] { return !server.network.relays().at(0).failure.text.empty(); }));
}

// Each try costs kilobytes, which a robot may pay for.
TEST(RelayDoor, WaitsLongForARelayThatIsNotItsOwnOrRefusesIt) {
  const std::string another_key(43, 'A');
  struct Case {
    std::string pin, token, log;
  };
  for (const Case& of : {Case{another_key + "=", "robot7-token", "not in tls.pin"},
                         Case{"", "wrong", "it refuses the token"}, Case{"", "", "has no token"}}) {
    AtRelay at;
    CountingWay way(at);
    Side server(at.loop);
    const Authority::Files files = relay_authority().sign("robot7", "DNS:robot7");
    ListenOptions listen;
    listen.port = 0;
    listen.tls = TlsOptions{files.certificate, files.key};
    listen.relay.emplace();
    listen.relay->url = {true, "127.0.0.1", way.port(), "/", "robot7"};
    listen.relay->tls.ca_file = relay_authority().ca;
    if (!of.pin.empty()) listen.relay->tls.pins = {of.pin};
    listen.relay->token = [&] { return of.token; };
    ASSERT_EQ(server.network.listen(listen), "");
    ASSERT_TRUE(at.loop.until([&] {
      return !server.logs.empty() && server.logs.back().find(of.log) != std::string::npos;
    })) << of.log;
    at.loop.run_for(1500ms);
    EXPECT_EQ(way.joints.size(), 1U) << of.log;
  }
}

// A relay by hand, that welcomes whoever comes, and says so many lines.
struct TalkingRelay {
  TalkingRelay(Loop& on, std::string text, int times)
      : loop(on),
        line(std::move(text)),
        count(times),
        door(on.io, {asio::ip::make_address("127.0.0.1"), 0}) {
    std::string problem;
    const Authority::Files files = relay_authority().sign("talking", "IP:127.0.0.1");
    context = make_server_tls(TlsOptions{files.certificate, files.key}, problem);
    SSL_CTX_set_alpn_select_cb(
        context->native_handle(),
        [](SSL*, const unsigned char** chosen, unsigned char* size, const unsigned char* offered,
           unsigned, void*) {
          *size = *offered;
          *chosen = offered + 1;
          return SSL_TLSEXT_ERR_OK;
        },
        nullptr);
    accept();
  }
  void accept() {
    door.async_accept(loop.io.get_executor(), [this](ErrorCode error, TcpSocket socket) {
      if (error) return;
      ++accepted;
      lines = std::make_shared<TlsLines>(std::move(socket), context);
      lines->shake_hands(true, {}, [this](ErrorCode wrong) {
        if (wrong) return;
        lines->open(kRelayLoginMax, {[this](std::string_view) { welcome(); }, [](auto&) {}});
      });
      accept();
    });
  }
  void welcome() {
    lines->say("welcome");
    for (int i = 0; i < count; ++i) lines->say(line);
    if (leaves) lines->finish();
  }

  Loop& loop;
  const std::string line;
  const int count;
  asio::ip::tcp::acceptor door;
  TlsContext context;
  std::shared_ptr<TlsLines> lines;
  int accepted = 0;
  bool leaves = false;  // when it has said them
};

// A robot's door to this relay.
std::shared_ptr<RelayDoor> door_to(
    TalkingRelay& relay, Loop& loop,
    std::function<void(LogLevel, const std::string&)> log = [](LogLevel, const std::string&) {}) {
  RelayOptions options;
  options.url = {true, "127.0.0.1", relay.door.local_endpoint().port(), "/", "robot7"};
  options.tls.ca_file = relay_authority().ca;
  options.token = [] { return std::string{"robot7-token"}; };
  return std::make_shared<RelayDoor>(
      loop.io, options, SocketOptions{},
      RelayDoor::Events{[](TcpSocket, const Source&) {}, std::move(log)});
}

TEST(RelayDoor, LeavesARelayThatNeverStopsTalking) {
  for (const std::string line : {"pong", "ping", "visitor"}) {
    Loop loop;
    const std::string ticket = std::string(64, 'a') + " 203.0.113.7 4711";
    TalkingRelay relay(loop, line == "visitor" ? line + ' ' + ticket : line, 2 * kRelayLinesAtOnce);
    std::vector<std::string> logs;
    const auto door =
        door_to(relay, loop, [&](LogLevel, const std::string& text) { logs.push_back(text); });
    ASSERT_EQ(door->open(), "");
    EXPECT_TRUE(loop.until([&] {
      return !logs.empty() && logs.back().find("more lines than allowed") != std::string::npos;
    })) << line;
    door->close();
    loop.run_for(1ms);
  }
}

// One that stands still reads at once what a relay has announced meanwhile: that is no fault.
TEST(RelayDoor, ComesBackSoonAfterTooManyLinesButNotForEver) {
  Loop loop;
  TalkingRelay relay(loop, "pong", 2 * kRelayLinesAtOnce);
  const auto door = door_to(relay, loop);
  ASSERT_EQ(door->open(), "");
  EXPECT_TRUE(loop.until([&] { return relay.accepted == 3; }, 4s));
  loop.run_for(1500ms);
  EXPECT_EQ(relay.accepted, 3);
  door->close();
  loop.run_for(1ms);
}

// As a balancer does whose relay is away. Each try costs TLS, which a robot may pay for.
TEST(RelayDoor, DialsRarelyWhereItIsWelcomedAndLeftAgainAndAgain) {
  Loop loop;
  TalkingRelay relay(loop, "", 0);
  relay.leaves = true;
  const auto door = door_to(relay, loop);
  ASSERT_EQ(door->open(), "");
  const int soon = Dialer::kAnswersSoon + 1;
  ASSERT_TRUE(loop.until([&] { return relay.accepted == soon; }, 60s));
  loop.run_for(2s);  // the next wait is 5 s or longer
  EXPECT_EQ(relay.accepted, soon);
  door->close();
  loop.run_for(1ms);
}

// A wait after a refusal takes up to a minute.
TEST(RelayDoor, AnotherTokenIsShownAtOnce) {
  for (const std::string refused : {"wrong", ""}) {
    AtRelay at;
    std::string token = refused;
    std::vector<std::string> logs;
    RelayOptions options;
    options.url = {true, "127.0.0.1", at.port(), "/", "robot7"};
    options.tls.ca_file = relay_authority().ca;
    options.token = [&] { return token; };
    const auto door = std::make_shared<RelayDoor>(
        at.loop.io, options, SocketOptions{},
        RelayDoor::Events{[](TcpSocket, const Source&) {},
                          [&](LogLevel, const std::string& text) { logs.push_back(text); }});
    ASSERT_EQ(door->open(), "");
    ASSERT_TRUE(at.loop.until([&] { return !logs.empty(); }));
    door->check_token();  // still the same
    at.loop.run_for(1500ms);
    EXPECT_EQ(at.relay->status().accepted, 1U);
    token = "robot7-token";
    door->check_token();
    EXPECT_TRUE(at.loop.until([&] { return door->place().connected_since > 0; }, 1500ms));
    door->close();
    at.loop.run_for(1ms);
  }
}

// From Wi-Fi to LTE, while the interface of the Wi-Fi keeps its address.
TEST(RelayDoor, AsksWhetherTheRelayIsThereWhenTheRouteHasChanged) {
  const bool allowed = in_own_network([] {
    set_up("lo");
    AtRelay at;
    CountingWay way(at);
    std::vector<std::string> logs;
    RelayOptions options;
    options.url = {true, "127.0.0.1", way.port(), "/", "robot7"};
    options.tls.ca_file = relay_authority().ca;
    options.token = [] { return std::string{"robot7-token"}; };
    const auto door = std::make_shared<RelayDoor>(
        at.loop.io, options, SocketOptions{},
        RelayDoor::Events{[](TcpSocket, const Source&) {},
                          [&](LogLevel, const std::string& text) { logs.push_back(text); }});
    ASSERT_EQ(door->open(), "");
    ASSERT_TRUE(at.loop.until([&] { return door->place().connected_since > 0; }));
    at.loop.run_for(50ms);
    const std::size_t said = way.said;
    give_address("lo:1", "10.0.0.1");  // as when a container starts
    at.loop.run_for(1500ms);
    EXPECT_EQ(way.said, said);
    set_up("lo", false);
    EXPECT_TRUE(at.loop.until([&] { return door->place().connected_since == 0; }, 4s));
    EXPECT_THAT(door->place().failure.text, testing::HasSubstr("no answer in time"));
    door->close();
    at.loop.run_for(1ms);
  });
  if (!allowed) GTEST_SKIP() << "this machine does not allow network namespaces";
}

// It names the address of who dials directly.
TEST(RelayDoor, VisitorsOfARelayTakeNothingOfWhoDialsDirectly) {
  Loop loop;
  TalkingRelay relay(loop, "visitor " + std::string(64, 'a') + " 127.0.0.1 4711", 30);
  Side server(loop), client(loop);
  const Authority::Files files = relay_authority().sign("robot7", "IP:127.0.0.1");
  ListenOptions listen;
  listen.port = 0;
  listen.tls = TlsOptions{files.certificate, files.key};
  listen.address_handshakes_at_once = 2;  // of the loopback 8 times as many
  listen.address_handshake_period = 800s;
  listen.relay.emplace();
  listen.relay->url = {true, "127.0.0.1", relay.door.local_endpoint().port(), "/", "robot7"};
  listen.relay->tls.ca_file = relay_authority().ca;
  listen.relay->token = [] { return std::string{"robot7-token"}; };
  ASSERT_EQ(server.network.listen(listen), "");
  ASSERT_TRUE(loop.until([&] { return server.network.counts().handshakes_dropped >= 25; }));
  DialOptions dial;
  dial.url = {true, "127.0.0.1", server.network.listen_port(), "/"};
  dial.tls.ca_file = relay_authority().ca;
  for (std::uint64_t id = 1; id <= 16; ++id) {
    client.network.dial(ConnectionId{id}, dial);
    ASSERT_TRUE(loop.until([&] { return server.opened.size() == id; })) << id;
  }
}

}  // namespace
}  // namespace connect_bridge::test
