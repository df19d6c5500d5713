#include "core/topics/local_topic.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/base/cdr.hpp"
#include "core/wire/frame.hpp"
#include "unit/flow/script.hpp"
#include "unit/topics/exporting.hpp"

namespace connect_bridge::topics_test {
namespace {

TEST(LocalTopic, IsSubscribedWhileALinkDemandsIt) {
  OneLink peer;
  Exporting s;
  s.see(topic("/a").pub(1));
  EXPECT_TRUE(s.offer(peer));
  EXPECT_FALSE(s.offer(peer));  // once
  EXPECT_EQ(s.did(), "");
  s.demand(peer);
  EXPECT_EQ(s.did(), "subscribe 1 /a reliable volatile 100\n");
  s.take(1, "hello");
  EXPECT_EQ(peer.said(), "1.1 hello\n");
  s.subject.on_link_lost(peer.link.id, ms(0));
  EXPECT_EQ(s.did(), "unsubscribe 1\n");
  EXPECT_EQ(peer.link.outgoing({1}), nullptr);
}

TEST(LocalTopic, AsksForTheWeakestOfWhatItsPublishersOffer) {
  OneLink peer;
  Exporting s;
  s.see(topic("/a").pub(1, latched(3)).pub(2, latched(5)));
  s.offer(peer);
  s.demand(peer);
  EXPECT_EQ(s.did(), "subscribe 1 /a reliable latched 100\n");
  s.see(topic("/a").pub(1, latched(3)).pub(2, latched(5)).pub(3, best_effort()));
  EXPECT_EQ(s.did(), "unsubscribe 1\nsubscribe 2 /a best_effort volatile 100\n");
  EXPECT_NE(s.logged.find("subscribed as volatile"), std::string::npos);
}

// A robot that starts, or comes back, must not drive by what its operator sent some time ago.
TEST(LocalTopic, AsksForNothingThatThePublisherOfACommandKeeps) {
  for (const TopicKey& key : {TopicKey{"/cmd_vel", "geometry_msgs/msg/Twist"},
                              TopicKey{"/robot1/goal_pose", "geometry_msgs/msg/PoseStamped"}}) {
    OneLink peer;
    Exporting s;
    LocalTopic command{s.context, key};
    Topic state = topic(key.first).pub(1, latched(1));
    state.type = key.second;
    s.graph = picture({state});
    command.on_graph(ms(0));
    EXPECT_TRUE(command.offer_to(peer.link, ms(0)));
    s.demand(peer);
    EXPECT_EQ(s.did(), "subscribe 1 " + key.first + " reliable volatile 100\n");
  }
}

TEST(LocalTopic, AsksForNothingThatIsKeptOfWhatDrivesByARuleHereOrThere) {
  Rule driving = everything();
  driving.treatment.drives = true;
  for (const bool here : {true, false}) {
    OneLink peer, other{2};
    Exporting s({here ? driving : everything()});
    s.see(topic("/a").pub(1, latched(3)));
    s.offer(peer);
    s.offer(other);
    peer.link.outgoing({1})->on_demand({.channel = {1}, .number = 1, .live = !here}, ms(0));
    EXPECT_EQ(s.did(), "subscribe 1 /a reliable volatile 100\n");
    if (here) continue;
    // Another peer wants what is kept: this one does not get it for all that.
    s.demand(other);
    EXPECT_EQ(s.did(), "unsubscribe 1\nsubscribe 2 /a reliable latched 100\n");
    s.subject.on_taken({{}, gid(1), flow_test::at_ms(-5), sample("yesterday"), 1}, ms(10));
    s.take(1, "now", 20);
    EXPECT_EQ(peer.said().find("yesterday"), std::string::npos);
    EXPECT_NE(other.said().find("yesterday"), std::string::npos);
  }
}

TEST(LocalTopic, IsSubscribedNotTooOften) {
  OneLink peer;
  Exporting s;
  s.see(topic("/a").pub(1));
  s.offer(peer);
  for (int i = 0; i < 11; ++i) {
    s.demand(peer, true);
    s.demand(peer, false);
  }
  s.did();
  s.demand(peer, true);
  EXPECT_EQ(s.did(), "");
  s.pass_to(1000);
  EXPECT_EQ(s.did(), "subscribe 11 /a reliable volatile 100\n");
}

// A rule lets one peer have it as best effort, and another one wants it all the time.
TEST(LocalTopic, IsNotSubscribedInAnotherWayTooOften) {
  Rule odd = everything();
  odd.identities = {"odd"};
  odd.treatment.qos.reliability = Reliability::kBestEffort;
  OneLink calm(1), toggles(2);
  toggles.link.login.set_identity({"odd", {}, 0});
  Exporting s({odd, everything()});
  s.see(topic("/a").pub(1));
  s.offer(calm);
  s.offer(toggles);
  s.demand(calm);
  EXPECT_EQ(s.did(), "subscribe 1 /a reliable volatile 100\n");
  for (int i = 0; i < 100; ++i) {
    s.demand(toggles, true);
    s.demand(toggles, false);
  }
  const std::string did = s.did();
  EXPECT_EQ(std::count(did.begin(), did.end(), '\n'), 2 * 9) << did;
  s.take(1, "still there");
  EXPECT_NE(calm.said(), "");
}

TEST(LocalTopic, ASampleOfAnUnknownPublisherWaitsForTheGraph) {
  OneLink peer;
  Exporting s;
  s.see(topic("/a").pub(1));
  s.offer(peer);
  s.demand(peer);
  s.did();
  s.take(2, "early");
  s.take(3, "never");
  EXPECT_EQ(s.did(), "refresh /a\nrefresh /a\n");  // once for each publisher
  s.take(2, "");
  EXPECT_EQ(s.did(), "");
  EXPECT_EQ(s.context.parked.used(), sample("earlynever").size() + 8);
  s.see(topic("/a").pub(1).pub(2), 100);
  EXPECT_EQ(peer.said(), "origins 1 +[2] -[]\n1.2 early, 1.2 \n");
}

// As long as the subscription is the one that was made for listeners, before the publisher came.
TEST(LocalTopic, WithoutANumberALatchedSampleIsKnownByItsStamp) {
  OneLink peer;
  Exporting s;
  Qos latched = qos();
  latched.durability = Durability::kTransientLocal;
  s.see(topic("/a").pub(1).pub(2, latched));  // subscribed as volatile
  s.offer(peer);
  s.demand(peer);
  peer.said();
  s.take(1, "volatile", 5);
  s.take(2, "latched", 5);
  std::vector<std::uint64_t> numbers;
  while (const auto packet = peer.link.connection()->next_packet(ms(5))) {
    const Bytes bytes = flow_test::joined(*packet);
    FrameReader reader(bytes);
    for (auto frame = reader.next(); frame && frame.value(); frame = reader.next())
      if (const auto* message = std::get_if<MessageFrame>(&*frame.value()))
        numbers.push_back(message->number);
  }
  EXPECT_EQ(numbers,
            (std::vector<std::uint64_t>{0, static_cast<std::uint64_t>(flow_test::at_ms(6))}));
}

TEST(LocalTopic, ASampleOfNobodyIsDroppedAfterASecond) {
  OneLink peer;
  Exporting s;
  s.see(topic("/a").pub(1));
  s.offer(peer);
  s.demand(peer);
  s.take(3, "never");
  s.pass_to(1000);
  EXPECT_EQ(s.context.parked.used(), 0U);
  EXPECT_EQ(s.context.timers.deadline(), std::nullopt);
  LinkStatus status;
  s.subject.add_status(peer.link.id, status);
  EXPECT_EQ(status.topics.at(0).dropped.of(DropReason::kUnknownOrigin), 1U);
}

TEST(LocalTopic, ALaterLinkGetsTheLastSamples) {
  OneLink early(1), late(2);
  Exporting s;
  s.see(topic("/a").pub(1, latched(2)));
  s.offer(early);
  s.offer(late);
  s.demand(early);
  for (int i = 1; i <= 3; ++i) s.take(1, std::to_string(i), i);
  s.demand(late);
  EXPECT_EQ(late.said(), "1.1 2, 1.1 3\n");
  s.demand(late, false);
  s.demand(late);
  EXPECT_EQ(late.said(), "1.1 2, 1.1 3\n");
  EXPECT_GT(s.subject.memory_bytes(), 0U);
}

// Of two bridges in one graph the first that listens may give way to the other.
// To change it at the first demand would lose a first message.
TEST(LocalTopic, IsSubscribedForListenersAsTheirRulesRequire) {
  Rule weak = everything();
  weak.treatment.qos.reliability = Reliability::kBestEffort;
  OneLink peer;
  Exporting s({weak});
  ListenerReport listener;
  listener.listener = {1};
  listener.name = "/a";
  listener.type = kType;
  ASSERT_TRUE(s.context.listeners.on_listeners(peer.link, {{listener}, {}}, ms(0)));
  s.subject.on_listeners(ms(0));
  EXPECT_EQ(s.did(), "subscribe 1 /a best_effort volatile 100\n");
  s.see(topic("/a").pub(1));
  s.offer(peer);
  s.demand(peer);
  EXPECT_EQ(s.did(), "");
}

// What publishers have kept comes together, and would not come again.
TEST(LocalTopic, ARateDoesNotHoldUpWhatItsPublishersHaveKept) {
  Rule limited = everything();
  limited.treatment.max_rate = 1;
  OneLink peer;
  Exporting s({limited});
  s.see(topic("/a").pub(1, latched(1)).pub(2, latched(1)).pub(3, latched(1)));
  s.offer(peer);
  s.demand(peer, true, 100);
  const auto take = [&](std::uint8_t publisher, std::int64_t stamp) {
    s.subject.on_taken(
        {{}, gid(publisher), flow_test::at_ms(stamp), sample(std::to_string(stamp)), {}}, ms(200));
  };
  for (std::uint8_t publisher = 1; publisher <= 3; ++publisher) take(publisher, 90 + publisher);
  EXPECT_EQ(peer.said(), "1.1 91, 1.2 92, 1.3 93\n");
  s.see(topic("/a").pub(1, latched(1)).pub(2, latched(1)).pub(3, latched(1)).pub(4, latched(1)));
  take(4, 210);  // it may be all that this one publishes
  EXPECT_EQ(peer.said(), "origins 1 +[4] -[]\n1.4 210\n");
  // No more than each of them keeps, whatever their clocks say.
  take(1, 94);  // the rate's first of this publisher
  take(1, 95);
  take(2, 201);
  take(2, 202);
  EXPECT_EQ(peer.said(), "1.1 94, 1.2 201\n");
}

Rule automatic() {
  Rule rule = everything();
  rule.treatment.compression.automatic = true;
  return rule;
}

// /a is demanded by peers whose paths have shown a round trip of 50 ms: a new connection may send
// 655 kB/s there.
struct Thin : Exporting {
  explicit Thin(const std::vector<OneLink*>& peers) : Exporting({automatic()}) {
    see(topic("/a").pub(1));
    for (OneLink* peer : peers) {
      offer(*peer);
      demand(*peer);
      peer->show_round_trip();
    }
    did();
  }
  void compressed(std::size_t bytes, std::int64_t at) { finish(Payload::adopt(Bytes(bytes)), at); }
};

TEST(LocalTopic, IsCompressedWhereThatIsSooner) {
  OneLink thin(1), unknown(2);
  Thin s({&thin});
  s.offer(unknown);
  s.demand(unknown);
  s.take(1, std::string(20'000, 'x'), 100);
  EXPECT_EQ(s.did(), "compress 1\n");
  EXPECT_EQ(unknown.said(100).substr(0, 6), "1.1 xx");
  s.take(1, "small", 100);  // overtakes nothing
  EXPECT_EQ(unknown.said(100), "1.1 small\n");
  EXPECT_EQ(thin.said(100), "");
  s.compressed(100, 101);
  EXPECT_EQ(thin.said(101), "1.1 zstd, 1.1 small\n");
}

TEST(LocalTopic, AQueueThatStandsKeepsNoLoopBusy) {
  for (std::size_t queued = 500; queued <= 8000; queued += 500) {
    OneLink thin;
    Thin s({&thin});
    s.take(1, std::string(100'000, 'x'), 100);
    s.did();
    s.compressed(queued, 100);
    s.take(1, std::string(100'000, 'y'), 100);
    const auto next = s.context.timers.deadline();
    EXPECT_TRUE(!next || *next >= ms(105).steady) << queued;
  }
}

TEST(LocalTopic, OfATypeThatIsLackingIsNotOfferedWhenItEndsEither) {
  OneLink peer;
  Exporting s;
  Topic lacking = topic("/a").pub(1);
  lacking.lack = TypeLack{"type_unknown", "the type is not known here"};
  s.see(lacking);
  EXPECT_FALSE(s.offer(peer));
  s.see(topic("/a"), 10);
  EXPECT_FALSE(s.offer(peer));
  s.pass_to(310);
  EXPECT_TRUE(s.subject.origins().empty());
}

TEST(LocalTopic, EndsWithItsLastOrigin) {
  OneLink peer;
  Exporting s;
  s.see(topic("/a").pub(1));
  s.offer(peer);
  s.demand(peer);
  s.did();
  s.see(topic("/a"), 10);
  s.pass_to(310);
  EXPECT_EQ(s.did(), "unsubscribe 1\n");
  EXPECT_EQ(peer.said(), "withdraw 1\n");
  EXPECT_TRUE(s.subject.origins().empty());
}

// The newest of each set of frames arrives, in whatever order they leave.
TEST(LocalTopic, ASampleOfOneOfSeveralStatesHasNoNumber) {
  for (const bool latches : {false, true}) {
    OneLink peer;
    Exporting s({everything()}, "tf2_msgs/msg/TFMessage", "/tf");
    Topic tf = topic("/tf").pub(1, latches ? latched(5) : qos(5));
    tf.type = "tf2_msgs/msg/TFMessage";
    s.see(tf);
    ASSERT_TRUE(s.offer(peer));
    Exporting::demand(peer);
    CdrWriter frames;
    frames.u32(1).u32(1).u32(0).string("map").string("odom");
    for (int i = 0; i < 7; ++i) frames.u64(0);
    s.subject.on_taken({{}, gid(1), flow_test::at_ms(5), frames.take(), 7}, ms(5));
    std::vector<std::uint64_t> numbers;
    while (const auto packet = peer.link.connection()->next_packet(ms(6))) {
      const Bytes bytes = flow_test::joined(*packet);
      FrameReader reader(bytes);
      for (auto frame = reader.next(); !packet->text && frame && frame.value();
           frame = reader.next())
        if (const auto* message = std::get_if<MessageFrame>(&*frame.value()))
          numbers.push_back(message->number);
    }
    EXPECT_EQ(numbers, std::vector<std::uint64_t>{latches ? 7U : 0U});
  }
}

}  // namespace
}  // namespace connect_bridge::topics_test
