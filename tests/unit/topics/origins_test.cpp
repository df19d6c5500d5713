#include "core/topics/origins.hpp"

#include <gtest/gtest.h>

#include "unit/topics/one_link.hpp"

namespace connect_bridge::topics_test {
namespace {

struct OriginsScript {
  // The publishers to report to the peers.
  std::string see(const Topic& state, std::int64_t at = 0) {
    return list_of(origins.update(&state, ms(at)), [](const Gid& g) { return g.bytes[0]; });
  }
  std::string removed(bool drained, std::int64_t at) {
    while (timers.take_due(ms(at).steady)) {
    }
    return list_of(origins.remove_vanished(
                       drained, [this](OriginId id) { return id.value == kept; }, ms(at)),
                   [](OriginId id) { return id.value; });
  }

  std::uint32_t kept = 0;  // something of this one waits for a link
  ExportTimers timers;
  Origins origins{{timers, nullptr}};
};

TEST(Origins, NewOnesAreToldOnce) {
  OriginsScript s;
  EXPECT_EQ(s.see(topic("/a").pub(7).pub(8)), "7 8");
  EXPECT_EQ(s.see(topic("/a").pub(7).pub(8).pub(9)), "9");
  EXPECT_EQ(s.origins.find(gid(9))->id, OriginId{3});
  EXPECT_EQ(s.origins.find(gid(1)), nullptr);
  EXPECT_EQ(s.origins.find(Gid{})->id, OriginId{1});  // not known: any one
}

// What the mirrors of all keep together is what the publishers keep.
TEST(Origins, OfSeveralThatKeepSamplesEachHasAsManyInTurnOfThoseWithoutAPublisher) {
  OriginsScript s;
  Qos two;
  two.depth = 2;
  s.see(topic("/a").pub(7).pub(8, two));
  std::string turns;
  for (int i = 0; i < 6; ++i)
    turns += std::to_string(s.origins.find(Gid{}, Durability::kTransientLocal)->id.value);
  EXPECT_EQ(turns, "122122");
  EXPECT_EQ(s.origins.find(gid(7), Durability::kTransientLocal)->id, OriginId{1});
  s.see(topic("/a"));
  EXPECT_EQ(s.removed(true, 300), "1 2");
  EXPECT_EQ(s.origins.find(Gid{}, Durability::kTransientLocal), nullptr);
}

TEST(Origins, ANameThatComesLaterIsTold) {
  OriginsScript s;
  Topic state = topic("/a").pub(7);
  state.publishers[0].node_name.clear();
  EXPECT_EQ(s.see(state), "7");
  EXPECT_EQ(s.see(topic("/a").pub(7)), "7");
  EXPECT_EQ(s.origins.at(gid(7)).node, "/n7");
}

TEST(Origins, OneThatLeavesLingersForAMoment) {
  OriginsScript s;
  s.see(topic("/a").pub(7));
  EXPECT_TRUE(s.origins.update(nullptr, ms(0)).empty());
  EXPECT_EQ(s.timers.deadline(), ms(300).steady);
  EXPECT_EQ(s.removed(true, 299), "");
  EXPECT_EQ(s.removed(true, 300), "1");
  EXPECT_TRUE(s.origins.empty());
}

TEST(Origins, OneThatComesBackInTimeHasNotLeft) {
  OriginsScript s;
  s.see(topic("/a").pub(7));
  s.see(topic("/a"));
  EXPECT_EQ(s.see(topic("/a").pub(7), 100), "");
  EXPECT_EQ(s.timers.deadline(), std::nullopt);
  EXPECT_EQ(s.removed(true, 1000), "");
}

TEST(Origins, WhileItsSamplesWaitOneLingersLonger) {
  OriginsScript s;
  s.see(topic("/a").pub(7));
  s.see(topic("/a"));
  EXPECT_EQ(s.removed(false, 300), "");
  EXPECT_EQ(s.removed(false, 3299), "");
  EXPECT_EQ(s.removed(false, 3300), "1");
}

}  // namespace
}  // namespace connect_bridge::topics_test
