#include "ops/status/lately.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

constexpr TimePoint kStart{1000h};

TEST(Lately, AGrowthIsOfThisPeriodAndTheLast) {
  RecentGrowth growth;
  EXPECT_EQ(growth.to(100, 1), 100U);
  EXPECT_EQ(growth.to(130, 2), 130U);
  EXPECT_EQ(growth.to(150, 3), 50U) << "since the second began";
  EXPECT_EQ(growth.to(150, 4), 20U);
  EXPECT_EQ(growth.to(150, 5), 0U);
  EXPECT_EQ(growth.to(160, 9), 10U) << "nobody looked for a while";
  EXPECT_EQ(growth.to(3, 9), 3U) << "it began again";
}

TEST(Lately, APeakStaysForTwoPeriods) {
  RecentPeak peak;
  EXPECT_EQ(peak.to(900, 1), 900);
  EXPECT_EQ(peak.to(1, 1), 900);
  EXPECT_EQ(peak.to(2, 2), 900);
  EXPECT_EQ(peak.to(3, 3), 3);
  EXPECT_EQ(peak.to(1, 7), 1);
}

TEST(Lately, OneMomentIsNoState) {
  RecentThird third;
  const auto look = [&](double value, std::int64_t period, Duration time) {
    return third.to(value, period, kStart + time);
  };
  EXPECT_EQ(look(900, 1, 0s), 0);
  EXPECT_EQ(look(900, 1, 1s), 0) << "the same moment";
  EXPECT_EQ(look(900, 1, 2s), 0);
  EXPECT_EQ(look(700, 1, 20s), 0);
  EXPECT_EQ(look(800, 1, 40s), 700);
  EXPECT_EQ(look(0, 2, 301s), 700);
  EXPECT_EQ(look(850, 2, 320s), 800);
  EXPECT_EQ(look(0, 3, 610s), 0);
}

TEST(Lately, TheSideKeepsTheWorstOfItsLastMinutes) {
  Lately lately(kStart);
  for (int i = 0; i < 5; ++i) lately.on_second(900, true, kStart + std::chrono::seconds(i));
  lately.on_second(1, false, kStart + 5s);
  const auto at = [&](Duration time) {
    RunStatus run;
    Status side;
    side.strangers.wrong_logins = 3;
    side.shared_bytes = 7;
    lately.add(run, side, kStart + time);
    return *run.lately;
  };
  EXPECT_EQ(at(6s).loop_lag_ms, 900);
  EXPECT_EQ(at(6s).held_up, 5U);
  EXPECT_EQ(at(6s).wrong_logins, 3U);
  EXPECT_EQ(at(6s).shared_bytes, 7U);
  at(5min);
  EXPECT_EQ(at(10min).loop_lag_ms, 0);
  EXPECT_EQ(at(10min).held_up, 0U);
  EXPECT_EQ(at(10min).wrong_logins, 0U);
}

LinkStatus link_with(std::uint64_t messages, std::uint64_t dropped) {
  LinkStatus link;
  link.number = 7;
  link.segments = 10 * messages;
  link.retransmitted = messages;
  TopicStatus& topic = link.topics.emplace_back();
  topic.topic = "/a";
  topic.messages = messages;
  topic.dropped.add(DropReason::kRate, dropped);
  return link;
}

TEST(Lately, TopicsOfALostLinkCountOnWhenItIsBack) {
  Lately lately(kStart);
  RunStatus run;
  const auto look = [&](LinkStatus link, Duration time) {
    lately.add(run, {}, kStart + time);
    lately.add(link, kStart + time);
    return link;
  };
  EXPECT_EQ(look(link_with(100, 20), 1min).topics[0].lately->dropped.of(DropReason::kRate), 20U);
  look(link_with(200, 20), 6min);
  LinkStatus lost;
  lost.number = 7;
  look(lost, 7min);
  const LinkStatus back = look(link_with(210, 25), 11min);
  EXPECT_EQ(back.topics[0].lately->messages, 110U) << "since the last period began";
  EXPECT_EQ(back.topics[0].lately->dropped.of(DropReason::kRate), 5U);
  EXPECT_EQ(back.lately->segments, 2100U) << "the connection is another one";
}

TEST(Lately, CallsOfAServiceCountInTheirTime) {
  Lately lately(kStart);
  const auto look = [&](std::uint64_t answered, std::uint64_t timed_out, Duration time) {
    LinkStatus link;
    link.number = 7;
    ServiceStatus& service = link.services.emplace_back();
    service.service = "/s";
    service.answered = answered;
    service.timed_out = service.refused = service.lost = timed_out;
    RunStatus run;
    lately.add(run, {}, kStart + time);
    lately.add(link, kStart + time);
    return *link.services[0].lately;
  };
  EXPECT_EQ(look(5, 4, 1min).timed_out, 4U);
  look(5, 4, 6min);
  EXPECT_EQ(look(7, 4, 11min).timed_out, 0U);
  EXPECT_EQ(look(7, 4, 12min).answered, 2U);
  EXPECT_EQ(look(7, 5, 13min).refused, 1U);
  EXPECT_EQ(look(7, 5, 13min).lost, 1U);
}

TEST(Lately, NothingCountsTwiceAfterALongBreak) {
  Lately lately(kStart);
  RunStatus run;
  const auto look = [&](LinkStatus link, Duration time) {
    lately.add(run, {}, kStart + time);
    lately.add(link, kStart + time);
    return link;
  };
  LinkStatus lost = link_with(100, 20);
  lost.open = true;
  look(lost, 1min);
  lost.open = false;
  lost.topics.clear();
  for (auto at = 2min; at < 30min; at += 1min) look(lost, at);
  EXPECT_EQ(look(link_with(110, 20), 30min).topics[0].lately->messages, 10U);
}

// A peer may offer other names again and again.
TEST(Lately, OfManyNamesThatALinkNoLongerShowsNoneIsKept) {
  const auto back = [](std::size_t topics, bool link_stays) {
    Lately lately(kStart);
    const auto look = [&](bool shown, Duration time) {
      RunStatus run;
      lately.add(run, {}, kStart + time);
      LinkStatus link = link_with(100, 0);
      link.open = true;
      link.topics.resize(shown ? topics : 0, link.topics[0]);
      for (std::size_t i = 0; i < link.topics.size(); ++i)
        link.topics[i].topic = "/a" + std::to_string(i);
      if (shown || link_stays) lately.add(link, kStart + time);
      return link;
    };
    for (const auto at : {1min, 6min, 11min}) look(true, at);
    look(false, 12min);
    return look(true, 13min).topics[0].lately->messages;
  };
  EXPECT_EQ(back(Lately::kLeftOutMax, true), 0U) << "they have not grown";
  EXPECT_EQ(back(Lately::kLeftOutMax + 1, true), 100U) << "they are new";
  EXPECT_EQ(back(1, false), 100U) << "the link was gone";
}

TEST(Lately, APictureIsNeededEachMinute) {
  Lately lately(kStart);
  EXPECT_FALSE(lately.is_due(kStart + 59s));
  EXPECT_TRUE(lately.is_due(kStart + 1min));
  RunStatus run;
  lately.add(run, {}, kStart + 1min);
  EXPECT_FALSE(lately.is_due(kStart + 119s));
}

}  // namespace
}  // namespace connect_bridge
