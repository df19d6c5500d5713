// Connections that come through a proxy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/net/tls/certificates.hpp"
#include "unit/net/tls/raw_tls.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge::test {
namespace {

using testing::HasSubstr;

ListenOptions trusting(NamedBy named_by, const std::string& proxies = "127.0.0.0/8") {
  ListenOptions options;
  options.trusted_proxies = {proxies};
  options.named_by = named_by;
  return options;
}

std::string forwarded_for(const std::string& address) {
  return upgrade_request("X-Forwarded-For: " + address + "\r\n");
}

constexpr char kProxied[] = "PROXY TCP4 203.0.113.5 10.0.0.1 50000 443\r\n";

// The peer's address at a server for a peer that sends this first.
std::string peer_of(const ListenOptions& options, const std::string& said) {
  Pair pair{options};
  EXPECT_EQ(pair.problem, "");
  RawPeer peer(pair.server.network.listen_port());
  peer.send(said);
  pair.loop.until([&] { return peer.poll(), peer.ended || !pair.server.opened.empty(); });
  return pair.server.opened.empty() ? "nobody" : pair.server.peers[pair.accepted()];
}

TEST(Proxy, TellsTheAddressOfItsClient) {
  EXPECT_EQ(peer_of(trusting(NamedBy::kXForwardedFor), forwarded_for("192.0.2.9, 203.0.113.5")),
            "203.0.113.5");
  EXPECT_EQ(peer_of(trusting(NamedBy::kXForwardedFor), forwarded_for("[2001:db8::5]:4711")),
            "[2001:db8::5]:4711");
  EXPECT_EQ(peer_of(trusting(NamedBy::kProxyProtocol), kProxied + upgrade_request()),
            "203.0.113.5:50000");
}

TEST(Proxy, OfOthersNothingIsBelieved) {
  const auto stranger = [](NamedBy named_by) { return trusting(named_by, "10.0.0.0/8"); };
  EXPECT_THAT(peer_of(stranger(NamedBy::kXForwardedFor), forwarded_for("203.0.113.5")),
              HasSubstr("127.0.0.1:"));
  EXPECT_THAT(peer_of(stranger(NamedBy::kProxyProtocol), upgrade_request()),
              HasSubstr("127.0.0.1:"));
  EXPECT_EQ(peer_of(stranger(NamedBy::kProxyProtocol), kProxied + upgrade_request()), "nobody");
}

TEST(Proxy, OneWayOfTellingOnly) {
  EXPECT_EQ(peer_of(trusting(NamedBy::kXForwardedFor), kProxied + upgrade_request()), "nobody");
  EXPECT_EQ(peer_of(trusting(NamedBy::kProxyProtocol), forwarded_for("203.0.113.5")), "nobody");
  EXPECT_EQ(peer_of(trusting(NamedBy::kProxyProtocol), kProxied + forwarded_for("192.0.2.9")),
            "203.0.113.5:50000");
}

// The log lines about proxies of a server that gets this three times.
std::string told(const ListenOptions& options, const std::string& said) {
  Pair pair{options};
  for (int i = 0; i < 3; ++i) {
    RawPeer peer(pair.server.network.listen_port());
    peer.send(said);
    pair.loop.until([&] { return peer.poll(), peer.ended || !peer.text.empty(); });
  }
  std::string all;
  for (const std::string& line : pair.server.logs)
    if (line.find("listen.") != std::string::npos ||
        line.find("does not say in") != std::string::npos)
      all += line.substr(line.find(": ") + 2) + "\n";
  return all;
}

// The operator must find it in the log, and strangers must not fill the log.
TEST(Proxy, WhatIsNotHeardIsToldNowAndThen) {
  const ListenOptions strangers = trusting(NamedBy::kXForwardedFor, "10.0.0.0/8");
  const std::string ignored =
      " is ignored, since listen.trusted_proxies does not name it: limits count its address\n";
  EXPECT_EQ(told(strangers, forwarded_for("203.0.113.5")), "its X-Forwarded-For" + ignored);
  const std::string version2{"\r\n\r\n\0\r\nQUIT\n\x21\0\0\0", 16};
  for (const std::string& header : {std::string{kProxied}, version2})
    EXPECT_EQ(told(strangers, header + upgrade_request()),
              "its header of the PROXY protocol is refused: listen.trusted_proxies does not name "
              "it, or listen.proxy_header is not proxy_protocol\n");
  EXPECT_EQ(
      told(trusting(NamedBy::kXForwardedFor), upgrade_request()),
      "this trusted proxy does not say in X-Forwarded-For for whom it connects: limits count its "
      "own address\n");
  EXPECT_EQ(told(trusting(NamedBy::kXForwardedFor), forwarded_for("203.0.113.5")), "");
  EXPECT_EQ(told({}, upgrade_request()), "");
}

TEST(Proxy, WhereNoOtherMayConnectNoneDoes) {
  ListenOptions options = trusting(NamedBy::kXForwardedFor, "10.0.0.0/8");
  options.proxies_only = true;
  EXPECT_EQ(peer_of(options, upgrade_request()), "nobody");
  options.trusted_proxies.emplace_back("127.0.0.1");
  EXPECT_EQ(peer_of(options, forwarded_for("203.0.113.5")), "203.0.113.5");
}

// A client that opens many connections through the proxy keeps no other client of the proxy out.
TEST(Proxy, LimitsCountTheClientsAddress) {
  ListenOptions options = trusting(NamedBy::kXForwardedFor);
  options.pending_per_address_max = 2;
  Pair pair{options};
  pair.server.packet_bytes_max = 0;  // nobody logs in
  const std::uint16_t port = pair.server.network.listen_port();
  const auto open = [&](RawPeer& peer, const std::string& address) {
    peer.send(forwarded_for(address));
    return peer.sees(pair.loop, "101 Switching");
  };
  RawPeer other(port), first(port), second(port), third(port);
  EXPECT_TRUE(open(other, "198.51.100.7"));
  EXPECT_TRUE(open(first, "203.0.113.5"));
  EXPECT_TRUE(open(second, "203.0.113.5"));
  EXPECT_TRUE(open(third, "203.0.113.5"));
  EXPECT_TRUE(first.ends(pair.loop));
  other.poll();
  second.poll();
  EXPECT_FALSE(other.ended || second.ended);
}

// A server with TLS whose proxies say by the PROXY protocol whom they bring; `name`: of its files.
ListenOptions behind_header(const std::string& name) {
  Authority authority{scratch_folder() + name};
  const auto files = authority.sign("robot", "IP:127.0.0.1");
  ListenOptions options = trusting(NamedBy::kProxyProtocol);
  options.tls = TlsOptions{files.certificate, files.key};
  return options;
}

// A client of it, behind this header.
std::unique_ptr<RawTls> brought(const Pair& pair, const std::string& header) {
  auto client = std::make_unique<RawTls>(pair.server.network.listen_port(), [](SSL_CTX*) {});
  EXPECT_EQ(::send(SSL_get_fd(client->tls()), header.data(), header.size(), MSG_NOSIGNAL),
            static_cast<ssize_t>(header.size()));
  return client;
}

bool shakes(Pair& pair, const std::string& header) {
  return brought(pair, header)->shakes(pair.loop);
}

// As HAProxy with send-proxy before a server that is not told of it.
TEST(Proxy, AHeaderThatIsNotExpectedIsCountedAndNamed) {
  ListenOptions options = behind_header("unexpected_");
  options.named_by = NamedBy::kXForwardedFor;
  for (const bool secure : {true, false}) {
    if (!secure) options.tls.reset();
    Pair pair{options};
    RawPeer peer(pair.server.network.listen_port());
    peer.send(kProxied + upgrade_request());
    ASSERT_TRUE(peer.ends(pair.loop));
    ASSERT_TRUE(pair.loop.until([&] { return pair.server.network.counts().refused == 1; }));
    const NetworkCounts counts = pair.server.network.counts();
    EXPECT_EQ(counts.proxy_headers, 1U);
    EXPECT_THAT(counts.last_refused, testing::StartsWith("127.0.0.1: "));
    EXPECT_THAT(counts.last_refused, HasSubstr("header of the PROXY protocol"));
  }
}

// The same server, where an address may begin one handshake.
ListenOptions for_one_each(const std::string& name) {
  ListenOptions options = behind_header(name);
  options.address_handshakes_at_once = 1;
  options.address_handshake_period = 800s;
  return options;
}

TEST(Proxy, ItsHeaderComesBeforeTls) {
  Pair pair{for_one_each("proxy_")};
  EXPECT_TRUE(shakes(pair, kProxied));
  EXPECT_FALSE(shakes(pair, kProxied)) << "handshakes are counted by the client's address";
  EXPECT_TRUE(shakes(pair, "PROXY TCP4 203.0.113.6 10.0.0.1 50000 443\r\n"));
  EXPECT_FALSE(shakes(pair, "")) << "there is no header";
}

// A client behind the proxy is known only after its header; then it waits as all others do.
TEST(Proxy, HandshakesOfAllAreSpreadOverTime) {
  ListenOptions options = behind_header("paced_");
  options.handshakes_at_once = 1;
  options.handshake_period = 200ms;
  options.handshake_timeout = 300ms;  // of each for itself
  Pair pair{options};
  std::vector<std::unique_ptr<RawTls>> clients;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 1; i <= 4; ++i) {
    clients.push_back(
        brought(pair, "PROXY TCP4 203.0.113." + std::to_string(i) + " 10.0.0.1 50000 443\r\n"));
    SSL_connect(clients.back()->tls());  // says its ClientHello
  }
  for (const auto& client : clients) EXPECT_TRUE(client->shakes(pair.loop));
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 600ms);
  EXPECT_GT(pair.server.network.counts().handshakes_waited, 0U);
  EXPECT_EQ(pair.server.network.counts().handshakes_dropped, 0U);
}

// Each address that it tells has a pace of its own, and uses up nothing of what all have.
TEST(Proxy, AnAddressThatItTellsDoesNotUseUpTheHandshakesOfAll) {
  ListenOptions options = for_one_each("shared_");
  options.handshakes_at_once = 2;
  options.handshake_period = 800s;
  Pair pair{options};
  EXPECT_TRUE(shakes(pair, kProxied));
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(shakes(pair, kProxied));
  EXPECT_TRUE(shakes(pair, "PROXY TCP4 203.0.113.6 10.0.0.1 50000 443\r\n"));
}

// It has a /56, so 256 of what limits count as an address.
TEST(Proxy, ACustomerOfManyAddressesHasTheHandshakesOfTwo) {
  Pair pair{for_one_each("customer_")};
  const auto shakes_from = [&](const std::string& from) {
    return shakes(pair, "PROXY TCP6 " + from + " 2001:db8::1 50000 443\r\n");
  };
  EXPECT_TRUE(shakes_from("2001:db8:0:101::5"));
  EXPECT_TRUE(shakes_from("2001:db8:0:102::5"));
  for (int i = 3; i <= 9; ++i)
    EXPECT_FALSE(shakes_from("2001:db8:0:10" + std::to_string(i) + "::5"));
  EXPECT_EQ(pair.server.network.counts().handshakes_dropped, 7U);
  EXPECT_TRUE(shakes_from("2001:db8:0:201::5")) << "it is another customer's";
}

// Its address has begun none then, and may when its customer may again.
TEST(Proxy, WhatItsCustomerIsRefusedIsNotCountedForAnAddress) {
  ListenOptions options = for_one_each("refunded_");
  options.address_handshakes_at_once = 1;
  options.address_handshake_period = 8s;  // 4 s of a customer
  Pair pair{options};
  const auto shakes_from = [&](const std::string& from) {
    return shakes(pair, "PROXY TCP6 " + from + " 2001:db8::1 50000 443\r\n");
  };
  EXPECT_TRUE(shakes_from("2001:db8:0:101::5"));
  EXPECT_TRUE(shakes_from("2001:db8:0:102::5"));
  const auto begin = std::chrono::steady_clock::now();
  bool begun = false;
  while (!begun && std::chrono::steady_clock::now() - begin < 7s) {
    begun = shakes_from("2001:db8:0:103::5");
    pair.loop.run_for(100ms);
  }
  EXPECT_TRUE(begun);
}

TEST(Proxy, WhenTooManyHandshakesWaitTheNewestOfWhoHasMostIsDropped) {
  ListenOptions options = behind_header("crowded_");
  options.handshakes_at_once = 1;
  options.handshake_period = 800s;
  options.pending_max = 6;  // half of them may wait
  Pair pair{options};
  const auto bring = [&](const std::string& from) {
    auto peer = std::make_unique<RawPeer>(pair.server.network.listen_port());
    peer->send("PROXY TCP4 " + from + " 10.0.0.1 50000 443\r\n\x16");
    pair.loop.run_for(50ms);
    return peer;
  };
  const auto begun = bring("203.0.113.5");
  const auto first = bring("203.0.113.5");
  const auto second = bring("203.0.113.5");
  const auto other = bring("203.0.113.6");
  const auto third = bring("203.0.113.7");
  EXPECT_TRUE(second->ends(pair.loop));
  for (RawPeer* const waiting : {begun.get(), first.get(), other.get(), third.get()}) {
    waiting->poll();
    EXPECT_FALSE(waiting->ended);
  }
  EXPECT_EQ(pair.server.network.counts().handshakes_dropped, 1U);
}

// The core limits wrong logins by it.
TEST(Proxy, TheLoopIsToldWhomLimitsCount) {
  Pair pair{trusting(NamedBy::kXForwardedFor)};
  RawPeer peer(pair.server.network.listen_port());
  peer.send(forwarded_for("2001:db8:0:1ff::5"));
  ASSERT_TRUE(pair.loop.until([&] { return !pair.server.opened.empty(); }));
  EXPECT_EQ(pair.server.openings.back().address, "2001:db8:0:1ff::")
      << "a customer has a /64 at least";
  EXPECT_EQ(pair.server.openings.back().customer, "2001:db8:0:100::") << "and mostly a /56";
  EXPECT_EQ(pair.server.openings.back().share, 1);
  RawPeer untold(pair.server.network.listen_port());
  untold.send(upgrade_request());
  ASSERT_TRUE(pair.loop.until([&] { return pair.server.opened.size() == 2; }));
  EXPECT_EQ(pair.server.openings.back().address, "127.0.0.1");
  EXPECT_EQ(pair.server.openings.back().share, 8);
}

TEST(Proxy, ASlowHeaderIsCut) {
  ListenOptions options = trusting(NamedBy::kProxyProtocol);
  options.handshake_timeout = 200ms;
  Pair pair{options};
  RawPeer peer(pair.server.network.listen_port());
  peer.send("PROXY TCP4 203.0.");
  EXPECT_TRUE(peer.ends(pair.loop, 2s));
}

}  // namespace
}  // namespace connect_bridge::test
