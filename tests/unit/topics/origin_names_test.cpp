// A graph may know a publisher earlier than the name of its node.
#include <gtest/gtest.h>

#include <vector>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

TEST(OriginNames, NodesAreNamedAsOnTheWire) {
  auto options = server();
  options.names = NameMap("/robot1", {});
  Script s(options);
  s.graph({});
  s.join(1);
  Topic state = topic("/robot1/a").pub(1).pub(2);
  state.publishers[0].node_namespace = "/robot1";
  s.graph({state});
  const auto packet = s.side.next_packet({1}, flow_test::now_ms(s.at));
  ASSERT_TRUE(packet && packet->text);
  const Bytes text = flow_test::joined(*packet);
  const auto control = decode_control({reinterpret_cast<const char*>(text.data()), text.size()});
  ASSERT_TRUE(control);
  std::set<std::string> nodes;
  for (const auto& origin : std::get<Offer>(control.value()).channels.at(0).origins)
    nodes.insert(origin.node);
  EXPECT_EQ(nodes, (std::set<std::string>{"/n1", "/n2"}));  // n2 is outside the prefix
}

constexpr std::int64_t kPatience = 2000;  // with an origin whose node has no name, in milliseconds

// The nodes for which mirrors were made since the last call.
std::vector<std::string> nodes_of_mirrors(Script& s) {
  std::vector<std::string> nodes;
  while (const auto action = s.side.next_action()) {
    if (const auto* create = std::get_if<CreateMirror>(&*action)) nodes.push_back(create->node);
  }
  return nodes;
}

struct WithProxies : Script {
  WithProxies() : Script(options()) {
    graph({});
    pass(1000);
  }
  static SideOptions options() {
    SideOptions result = server();
    result.proxy_nodes = true;
    return result;
  }
  static OriginOffer nameless() {
    OriginOffer result = origin(1, 11);
    result.node.clear();
    return result;
  }
};

TEST(OriginNames, AMirrorIsMadeWhenItsOriginsNodeHasAName) {
  WithProxies s;
  s.join(1);
  s.say(1, Offer{{channel(1, "/a", {s.nameless()})}, true});
  s.pass(999);
  EXPECT_EQ(nodes_of_mirrors(s), std::vector<std::string>{});
  s.say(1, OriginsChanged{{1}, {origin(1, 11)}, {}});
  EXPECT_EQ(nodes_of_mirrors(s), std::vector<std::string>{"/peer_node"});
}

TEST(OriginNames, AMirrorMovesToItsOriginsNodeOnce) {
  WithProxies s;
  s.join(1);
  const OriginOffer nameless = s.nameless();
  s.say(1, Offer{{channel(1, "/a", {nameless})}, true});
  s.pass(kPatience);
  EXPECT_EQ(nodes_of_mirrors(s), std::vector<std::string>{""});
  for (int i = 0; i < 2; ++i) s.say(1, OriginsChanged{{1}, {origin(1, 11)}, {}});
  EXPECT_EQ(nodes_of_mirrors(s), std::vector<std::string>{"/peer_node"});
}

TEST(OriginNames, WhicheverLinkTellsTheName) {
  WithProxies s;
  s.join(1);
  s.join(2);
  const OriginOffer nameless = s.nameless();
  s.say(1, Offer{{channel(1, "/a", {nameless})}, true});
  s.say(2, Offer{{channel(1, "/a", {nameless})}, true});
  s.pass(kPatience);
  EXPECT_EQ(nodes_of_mirrors(s), std::vector<std::string>{""});
  s.say(2, OriginsChanged{{1}, {origin(1, 11)}, {}});
  EXPECT_EQ(nodes_of_mirrors(s), std::vector<std::string>{"/peer_node"});
  // Nor does one that does not know it take it back.
  s.join(3);
  s.say(3, Offer{{channel(1, "/a", {nameless})}, true});
  EXPECT_EQ(nodes_of_mirrors(s), std::vector<std::string>{});
}

TEST(OriginNames, OfTooManyNodesTheLastOnesAreOurOwn) {
  WithProxies s;
  s.join(1);
  std::vector<std::string> expected;
  for (std::uint32_t n = 1; n <= ProxyNames::kMost + 2; ++n) {
    OriginOffer from = origin(1, 11);
    from.gid.bytes[1] = static_cast<std::uint8_t>(n >> 8);
    from.gid.bytes[2] = static_cast<std::uint8_t>(n);
    from.node = "/node" + std::to_string(n);
    s.say(1, Offer{{channel(n, "/t" + std::to_string(n), {from})}, true});
    expected.push_back(n <= ProxyNames::kMost ? from.node : "");
  }
  std::vector<std::string> nodes;
  for (int i = 0; i < 50; ++i) {
    s.pass(1000 + 100 * i);
    for (auto& node : nodes_of_mirrors(s)) nodes.push_back(std::move(node));
  }
  EXPECT_EQ(nodes, expected);
}

// Origins with the numbers from `first` on, each another publisher.
std::vector<OriginOffer> numbered(std::uint32_t first, std::uint32_t count) {
  std::vector<OriginOffer> origins;
  for (std::uint32_t id = first; id < first + count; ++id) {
    origins.push_back(origin(id, static_cast<std::uint8_t>(id)));
    origins.back().gid.bytes[1] = static_cast<std::uint8_t>(id >> 8);
  }
  return origins;
}

// A server that makes mirrors of all that a channel may have.
SideOptions roomy() {
  SideOptions options = server();
  options.topic_mirrors_max = kChannelOriginsMax;
  return options;
}

TEST(OriginNames, NamesDoNotCountAsOrigins) {
  Script s(roomy());
  s.graph({});
  s.pass(1000);
  s.join(1);
  const auto origins = numbered(1, kChannelOriginsMax);
  s.offer(1, {channel(1, "/a", origins)}, true);
  s.say(1, OriginsChanged{{1}, origins, {}});
  EXPECT_EQ(s.did().find("close"), std::string::npos);
  s.say(1, OriginsChanged{{1}, {origin(kChannelOriginsMax + 1, 1)}, {}});
  EXPECT_NE(s.did().find("close 1 4006"), std::string::npos);
}

// Those without a mirror count, too.
TEST(OriginNames, OriginsThatAreLeftOutCount) {
  SideOptions options = server();
  options.topic_mirrors_max = 10;
  Script s(options);
  s.graph({});
  s.pass(1000);
  s.join(1);
  s.offer(1, {channel(1, "/a", numbered(1, kChannelOriginsMax))}, true);
  s.say(1, OriginsChanged{{1}, numbered(2000, 1), {{kChannelOriginsMax}}});
  EXPECT_EQ(s.did().find("close"), std::string::npos);
  s.say(1, OriginsChanged{{1}, numbered(3000, 1), {}});
  EXPECT_NE(s.did().find("close 1 4006"), std::string::npos);
}

// A publisher that is offered under another number in the message that removes the old one keeps
// its mirror.
TEST(OriginNames, APublisherCanGetAnotherNumber) {
  Script s(server());
  s.graph({});
  s.pass(1000);
  s.join(1);
  s.say(1, Offer{{channel(1, "/a", {origin(1, 11)})}, true});
  s.did();
  s.say(1, OriginsChanged{{1}, {origin(2, 11)}, {{1}}});
  s.pass(1000);
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.status().links.at(0).topics.at(0).origins, 1U);
}

}  // namespace
}  // namespace connect_bridge::side_test
