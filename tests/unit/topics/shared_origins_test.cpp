// Several links that offer the same publishers: what happens to one link, or to a name of the
// graph, costs that link's publishers, or that name's. How often a topic judges its demand is
// counted.
#include <gtest/gtest.h>

#include <deque>

#include "core/mirrors/peer_topics.hpp"
#include "unit/topics/one_link.hpp"

namespace connect_bridge::topics_test {
namespace {

constexpr std::uint32_t kLinks = 8;
constexpr std::uint8_t kPublishers = 16;

struct SharedOrigins : Actions {
  explicit SharedOrigins(const Qos& qos) {
    policy = Policy({everything()});
    imports.on_graph(ms(-1000));
    const auto account = std::make_shared<Account>();
    for (std::uint32_t n = 1; n <= kLinks; ++n) {
      Link& link = links.emplace_back(n, account).link;
      link.expect_offered({1}, InterfaceKind::kTopic);
      std::vector<OriginOffer> origins;
      for (std::uint8_t i = 1; i <= kPublishers; ++i) origins.push_back(origin(i, i, qos));
      imports.on_offer(link, channel(1, "/a", std::move(origins)), ms(0));
    }
  }
  // The topics with these subscribers are the graph now.
  void see(std::vector<Topic> topics) {
    GraphView next = picture(topics);
    const GraphDifference difference = next.since(graph);
    graph = std::move(next);
    imports.on_graph(ms(0), difference);
  }
  std::string demanded() {
    imports.send_demands();
    std::string all;
    for (OneLink& one : links)
      if (const std::string said = one.said(); !said.empty())
        all += std::to_string(one.link.id.value) + ": " + said;
    return all;
  }
  void lose(std::uint32_t link) {
    LinkEnd all;
    EXPECT_TRUE(imports.on_link_lost({link}, all, ms(0)));
  }
  // Judgements of demands since it was asked last.
  std::uint64_t judged() { return imports.judged() - std::exchange(before, imports.judged()); }

  std::deque<OneLink> links;
  TopicOptions options;
  connect_bridge::PeerTopics imports{side, options};
  std::uint64_t before = 0;
};

TEST(SharedOrigins, ALostLinkCostsItsPublishersAndNotThoseOfTheOthers) {
  for (const Qos& qos : {qos(), latched()}) {
    SharedOrigins s(qos);
    s.see({topic("/a").sub(50)});
    EXPECT_EQ(s.demanded(), "1: demand 1 on\n");
    s.judged();
    s.lose(1);
    EXPECT_LE(s.judged(), 3U * kPublishers);
    EXPECT_GT(s.before, 0U);
  }
}

TEST(SharedOrigins, TheNextLinkIsAskedWhenTheFeedingOneIsLost) {
  SharedOrigins s(qos());
  s.see({topic("/a").sub(50)});
  EXPECT_EQ(s.demanded(), "1: demand 1 on\n");
  for (std::uint32_t lost = 1; lost < kLinks; ++lost) {
    s.lose(lost);
    EXPECT_EQ(s.demanded(), std::to_string(lost + 1) + ": demand 1 on\n");
  }
  s.see({});
  EXPECT_EQ(s.demanded(), std::to_string(kLinks) + ": demand 1 off\n");
}

TEST(SharedOrigins, ADeadLinkIsLookedForAtItsOwnTopics) {
  SharedOrigins s(qos());
  s.lose(1);
  s.judged();
  LinkEnd all;
  EXPECT_TRUE(s.imports.on_link_dead(s.links.front().link, all, ms(0)));
  EXPECT_LE(s.judged(), kPublishers);
  EXPECT_EQ(s.links.front().link.mirrors.all(), 0U);
}

TEST(SharedOrigins, AnotherNameOfTheGraphCostsNothing) {
  SharedOrigins s(latched());
  s.judged();
  s.see({topic("/b").pub(60).sub(61)});
  EXPECT_EQ(s.judged(), 0U);
  s.see({topic("/b").pub(60).sub(61), topic("/a").pub(62)});
  EXPECT_EQ(s.judged(), 0U);
  s.see({topic("/b").pub(60).sub(61), topic("/a").pub(62).sub(63)});
  EXPECT_LE(s.judged(), kPublishers);
  EXPECT_EQ(s.demanded(), "1: demand 1 on\n");
}

// Its publisher here may come with another name: a loop is known by the id.
TEST(SharedOrigins, APublisherThatIsHereItselfEndsItsMirrorAlone) {
  SharedOrigins s(qos());
  s.did();
  s.see({topic("/b").pub(3)});
  EXPECT_EQ(s.did(), "unmirror 3\n");
  EXPECT_LE(s.judged(), 2U * kLinks * kPublishers);
}

}  // namespace
}  // namespace connect_bridge::topics_test
