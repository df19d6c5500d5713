#include "ops/status/metrics.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <iterator>
#include <regex>

#include "unit/source_text.hpp"

namespace connect_bridge {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

constexpr TimePoint kNow{std::chrono::hours(100)};

TopicStatus topic(const std::string& name, std::uint64_t messages) {
  TopicStatus made;
  made.topic = name;
  made.type = "p/msg/T";
  made.messages = messages;
  return made;
}

StatusPicture picture_of(std::vector<std::pair<std::uint64_t, std::vector<TopicStatus>>> links) {
  StatusPicture made;
  for (auto& [number, topics] : links) {
    LinkStatus link;
    link.number = number;
    link.identity = "anna";
    link.node = "/of_anna";
    link.peer = "203.0.113.5:4";
    link.topics = std::move(topics);
    made.side.links.push_back(std::move(link));
  }
  made.places.follow(made.side.links);
  return made;
}

TEST(Metrics, BothFormats) {
  Metrics metrics;
  StatusPicture one = picture_of({{7, {topic("/a", 3)}}});
  one.side.links[0].topics[0].dropped.add(DropReason::kRate, 2);
  one.side.links[0].topics[0].latency_ms = 12.5;
  metrics.count(one, kNow);
  EXPECT_THAT(metrics.text(true),
              AllOf(HasSubstr("# TYPE connect_bridge_topic_messages counter\n"
                              "connect_bridge_topic_messages_total{direction=\"import\",topic="
                              "\"/a\"} 3\n"),
                    HasSubstr("topic_dropped_total{direction=\"import\",topic=\"/a\",reason="
                              "\"rate\"} 2\n"),
                    HasSubstr("topic_age_seconds{direction=\"import\",topic=\"/a\"} 0.0125\n"),
                    HasSubstr("connect_bridge_link_open{link=\"1\"} 0\n"), EndsWith("# EOF\n"),
                    Not(HasSubstr("anna")), Not(HasSubstr("203.0"))));
  EXPECT_THAT(metrics.text(false),
              AllOf(HasSubstr("# TYPE connect_bridge_topic_messages_total counter\n"),
                    Not(HasSubstr("# EOF"))));
}

// A link that ends, or counts anew, takes nothing away that was counted.
TEST(Metrics, CountersOfATopicOnlyGrow) {
  Metrics metrics;
  const auto shown = [&] {
    const std::string text = metrics.text(true);
    const std::string before = "topic_messages_total{direction=\"import\",topic=\"/a\"} ";
    const auto at = text.find(before) + before.size();
    return text.substr(at, text.find('\n', at) - at);
  };
  metrics.count(picture_of({{7, {topic("/a", 3)}}, {8, {topic("/a", 4)}}}), kNow);
  EXPECT_EQ(shown(), "7");
  metrics.count(picture_of({{8, {topic("/a", 6)}}}), kNow);
  EXPECT_EQ(shown(), "9");
  metrics.count(picture_of({{8, {topic("/a", 1)}}, {9, {topic("/a", 1)}}}), kNow);
  EXPECT_EQ(shown(), "11");
}

TEST(Metrics, WhatIsPublishedAndWhatIsSentAgain) {
  StatusPicture one = picture_of({{7, {topic("/a", 3)}}});
  TopicStatus& shown = one.side.links[0].topics[0];
  shown.exported = true;
  shown.dropped.add(DropReason::kNewerAvailable, 27);
  one.side.links[0].segments = 50;
  one.side.links[0].retransmitted = 4;
  one.run.relays = {{"wss://robot@relay:443", 1, {}}};
  Metrics metrics;
  metrics.count(one, kNow);
  EXPECT_THAT(metrics.text(true),
              AllOf(HasSubstr("topic_published_total{direction=\"export\",topic=\"/a\"} 30\n"),
                    HasSubstr("connect_bridge_relay_connected 1\n"),
                    HasSubstr("link_segments_total{link=\"1\"} 50\n"),
                    HasSubstr("link_retransmitted_total{link=\"1\"} 4\n")));
}

// Ages of two links have no sum, calls have.
TEST(Metrics, GaugesOfSeveralLinks) {
  StatusPicture two = picture_of({{7, {topic("/a", 1)}}, {8, {topic("/a", 1)}}});
  for (LinkStatus& link : two.side.links) {
    link.topics[0].latency_ms = static_cast<double>(link.number);
    ServiceStatus& service = link.services.emplace_back();
    service.service = "/s";
    service.pending = 2;
    service.timed_out = 1;
  }
  Metrics metrics;
  metrics.count(two, kNow);
  EXPECT_THAT(metrics.text(true),
              AllOf(HasSubstr("topic_age_seconds{direction=\"import\",topic=\"/a\"} 0.008\n"),
                    HasSubstr("service_calls_under_way{direction=\"import\",service=\"/s\"} 4\n"),
                    HasSubstr("service_calls_ended_total{direction=\"import\",service=\"/s\","
                              "how=\"timed_out\"} 2\n")));
}

// A sum of two qualities would be none.
TEST(Metrics, TheWorstOfWhatIsNotExact) {
  StatusPicture two = picture_of({{7, {topic("/a", 1)}}, {8, {topic("/a", 1)}}});
  two.side.links[0].topics[0].sent_as = {Codec::kPictureBase, 0, 30};
  two.side.links[1].topics[0].sent_as = {Codec::kPictureBase, 0, 40};
  two.side.links[0].topics.push_back(topic("/points", 1));
  two.side.links[0].topics[1].sent_as = {Codec::kCloud, 5000};
  Metrics metrics;
  metrics.count(two, kNow);
  EXPECT_THAT(
      metrics.text(true),
      AllOf(HasSubstr("topic_picture_quantiser{direction=\"import\",topic=\"/a\"} 40\n"),
            HasSubstr("topic_rounded_to_metres{direction=\"import\",topic=\"/points\"} 0.005\n"),
            Not(HasSubstr("topic_rounded_to_metres{direction=\"import\",topic=\"/a\""))));
}

TEST(Metrics, APlaceServesAgain) {
  Metrics metrics;
  StatusPicture now = picture_of({{7, {}}, {8, {}}});
  metrics.count(now, kNow);
  now.side.links = picture_of({{8, {}}, {9, {}}}).side.links;
  now.places.follow(now.side.links);
  metrics.count(now, kNow);
  EXPECT_THAT(metrics.text(true), AllOf(HasSubstr("link=\"1\""), HasSubstr("link=\"2\""),
                                        Not(HasSubstr("link=\"3\""))));
}

// A picture that is taken while the link is lost shows no topic of it.
TEST(Metrics, ABreakCountsNothingTwice) {
  Metrics metrics;
  metrics.count(picture_of({{7, {topic("/a", 100)}}}), kNow);
  metrics.count(picture_of({{7, {}}}), kNow + std::chrono::seconds(1));
  metrics.count(picture_of({{7, {topic("/a", 103)}}}), kNow + std::chrono::seconds(2));
  EXPECT_THAT(metrics.text(true), HasSubstr("topic=\"/a\"} 103\n"));
  for (auto at = std::chrono::minutes(1); at < std::chrono::minutes(20); ++at)
    metrics.count(picture_of({{7, {}}}), kNow + at);
  metrics.count(picture_of({{7, {topic("/a", 104)}}}), kNow + std::chrono::minutes(20));
  EXPECT_THAT(metrics.text(true), HasSubstr("topic=\"/a\"} 104\n"));
}

// `count` topics named `before`, and a number.
std::vector<TopicStatus> topics(const std::string& before, std::size_t count) {
  std::vector<TopicStatus> made;
  for (std::size_t i = 0; i < count; ++i) made.push_back(topic(before + std::to_string(i), 1));
  return made;
}

std::size_t lines_with(const Metrics& metrics, const std::string& what) {
  const std::string text = metrics.text(true);
  std::size_t lines = 0;
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; ++at) ++lines;
  return lines;
}

TEST(Metrics, APeerCannotMakeSeriesWithoutEnd) {
  Metrics metrics;
  const auto lines = [&] { return lines_with(metrics, "topic_messages_total{"); };
  metrics.count(picture_of({{1, topics("/a", Metrics::kNamesMax)}}), kNow);
  const auto before = lines();
  for (std::size_t i = 0; i < 100; ++i)
    metrics.count(picture_of({{i + 1, {topic("/more" + std::to_string(i), 1)}}}), kNow);
  EXPECT_EQ(lines(), before);
  EXPECT_THAT(metrics.text(true),
              HasSubstr("topic=\"other\"} " +
                        std::to_string(Metrics::kNamesMax - Metrics::kNamesOfPeersMax / 2 + 100)));
}

// N14: names of one identity leave room for those of another, and for this side's own.
TEST(Metrics, AnIdentityHasAShareOfTheNames) {
  Metrics metrics;
  StatusPicture two = picture_of({{1, topics("/a", 5000)}, {2, topics("/b", 100)}, {3, {}}});
  two.side.links[1].identity = "ben";
  for (TopicStatus& own : two.side.links[2].topics = topics("/own", 400)) own.exported = true;
  metrics.count(two, kNow);
  EXPECT_EQ(lines_with(metrics, "topic_messages_total{direction=\"import\",topic=\"/b"), 100U);
  EXPECT_EQ(lines_with(metrics, "topic_messages_total{direction=\"export\",topic=\"/own"), 400U);
}

TEST(Metrics, ANameWithoutALinkIsForgotten) {
  Metrics metrics;
  const std::size_t share = Metrics::kNamesOfPeersMax / 2;
  metrics.count(picture_of({{1, topics("/old", share)}}), kNow);
  metrics.count(picture_of({{1, {topic("/new", 1)}}}), kNow + std::chrono::minutes(59));
  EXPECT_EQ(lines_with(metrics, "topic=\"/new\""), 0U);
  metrics.count(picture_of({}), kNow + std::chrono::minutes(60));
  EXPECT_EQ(lines_with(metrics, "topic=\"/old"), 0U);
  metrics.count(picture_of({{2, {topic("/new", 1)}}}), kNow + std::chrono::minutes(61));
  EXPECT_GE(lines_with(metrics, "topic=\"/new\""), 1U);
}

TEST(Metrics, ANameIsNoMarkup) {
  Metrics metrics;
  metrics.count(picture_of({{1, {topic("/a\"} 1\nb{x=\"\\", 1)}}}), kNow);
  EXPECT_THAT(metrics.text(true), HasSubstr("topic=\"/a\\\"} 1\\nb{x=\\\"\\\\\"} 1\n"));
}

// What config/ asks Prometheus for is there.
TEST(Metrics, AlertsAndDashboardAskForWhatIsThere) {
  StatusPicture all = picture_of({{1, {topic("/a", 1)}}});
  LinkStatus& link = all.side.links[0];
  link.clock.known = true;
  link.topics[0].dropped.add(DropReason::kRate);
  link.topics[0].latency_ms = 1;
  link.topics[0].bytes = 1;
  link.services.resize(1);
  link.services[0].calls = link.services[0].lost = 1;
  all.run.certificate_end = kStampSecond;
  all.run.audit.emplace();
  Metrics metrics;
  metrics.count(all, kNow);
  const std::string text = metrics.text(false);
  const std::regex name("connect_bridge_[a-z_]+");
  for (const char* file : {"config/alerts.yaml", "config/grafana_dashboard.json"}) {
    const std::string asks = test::source_text(file);
    const std::sregex_iterator begin(asks.begin(), asks.end(), name), end;
    EXPECT_GE(std::distance(begin, end), 9) << file;
    for (auto at = begin; at != end; ++at)
      EXPECT_THAT(text, HasSubstr("# TYPE " + at->str() + " ")) << file;
  }
}

}  // namespace
}  // namespace connect_bridge
