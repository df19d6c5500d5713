// What the log says of subscribers that a mirror cannot serve.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "unit/mirrors/peer_topic_script.hpp"

namespace connect_bridge::topics_test {
namespace {

// A mirror of a volatile publisher.
struct Warning : OfferedScript {
  explicit Warning(const std::string& node = "/peer_node") : subject(made_for(node)) {}

  TopicMirror& made_for(const std::string& node) {
    OriginOffer offered = origin(1, 7);
    offered.node = node;
    offer(peer, {offered});
    pass_to(10'000);  // then it is made without its origin's name
    did();
    logged.clear();
    return mirror(7);
  }
  void see(const Topic& state) { graph = picture({state}); }
  // A subscriber that requests samples from before, and has no name yet.
  void see_unnamed() {
    Topic state = topic("/a").sub(50, latched());
    state.subscribers.front().node_name.clear();
    see(state);
  }
  std::string look(std::int64_t at) {
    subject.warn_incompatible(ms(at));
    did();
    return std::exchange(logged, "");
  }
  // Whether the mirror is to be looked at by then.
  [[nodiscard]] bool is_due(std::int64_t at) const {
    return context.mirrors.timers().deadline().value_or(TimePoint::max()) <= ms(at).steady;
  }

  TopicMirror& subject;
};

TEST(SubscriberWarning, EachIsNamedOnce) {
  Warning s;
  s.see(topic("/a").sub(50, latched()).sub(51).sub(52, latched()));
  const std::string lines = s.look(20'000);
  EXPECT_NE(lines.find("/n50"), std::string::npos);
  EXPECT_NE(lines.find("/n52"), std::string::npos);
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 2) << lines;  // the other one fits
  EXPECT_EQ(s.look(20'001), "");
  EXPECT_FALSE(s.is_due(100'000));
}

TEST(SubscriberWarning, OneWithoutANameIsWaitedForAndThenToldWithout) {
  Warning s;
  s.see_unnamed();
  EXPECT_EQ(s.look(20'000), "");
  EXPECT_EQ(s.look(21'000), "");
  EXPECT_FALSE(s.is_due(21'999));
  EXPECT_TRUE(s.is_due(22'000));
  EXPECT_NE(s.look(22'000), "");
  EXPECT_FALSE(s.is_due(100'000));
  EXPECT_EQ(s.look(30'000), "");
}

TEST(SubscriberWarning, OneThatGetsItsNameIsToldByIt) {
  Warning s;
  s.see_unnamed();
  EXPECT_EQ(s.look(20'000), "");
  s.see(topic("/a").sub(50, latched()));
  EXPECT_NE(s.look(20'500).find("/n50"), std::string::npos);
  EXPECT_EQ(s.look(22'000), "");
}

TEST(SubscriberWarning, ThePublishersNameIsWaitedForToo) {
  Warning s("");
  s.see(topic("/a").sub(50, latched()));
  EXPECT_EQ(s.look(20'000), "");
  EXPECT_NE(s.look(22'000).find("/n50"), std::string::npos);
}

TEST(SubscriberWarning, OfAMirrorThatIsGoneNothingIsTold) {
  Warning s;
  s.see_unnamed();
  EXPECT_EQ(s.look(20'000), "");
  s.subject.destroy();
  EXPECT_FALSE(s.is_due(22'000));
  s.subject.update(ms(22'000));
  EXPECT_EQ(s.look(22'000), "");  // another one was made: its time begins
  EXPECT_TRUE(s.is_due(24'000));
}

TEST(SubscriberWarning, WithAMiddlewareThatServesAllThereIsNone) {
  Warning s;
  s.names.qos_must_fit = false;
  s.see(topic("/a").sub(50, latched()));
  EXPECT_EQ(s.look(20'000), "");
}

}  // namespace
}  // namespace connect_bridge::topics_test
