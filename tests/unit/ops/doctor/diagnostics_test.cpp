#include "ops/doctor/diagnostics.hpp"

#include <gmock/gmock.h>

#include "core/base/cdr.hpp"

namespace connect_bridge {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::Field;
using testing::HasSubstr;
using testing::Not;
using testing::Pair;
using Level = Diagnostic::Level;

constexpr Stamp kDay = 24 * 3600 * kStampSecond;
constexpr Stamp kToday = 20'000 * kDay;

StatusPicture picture(std::vector<std::uint64_t> numbers, Role role = Role::kServer) {
  StatusPicture made;
  made.run.node = "/robot/connect";
  made.run.role = role;
  made.side.shared_bytes_max = 100;
  for (const auto number : numbers) {
    LinkStatus link;
    link.number = number;
    link.open = true;
    link.peer = "203.0.113.5:4";
    link.node = "/of_anna";
    link.identity = "anna";
    made.side.links.push_back(link);
  }
  return made;
}

std::vector<Diagnostic> told(StatusPicture picture) {
  picture.places.follow(picture.side.links);
  return diagnostics_of(picture, kToday);
}

TEST(Diagnostics, OfTheSideAndEachLinkInTheWordsOfTheStatus) {
  StatusPicture now = picture({7, 9});
  now.side.links[0].clock = {true, std::chrono::milliseconds(2), std::chrono::milliseconds(30), {}};
  const auto all = told(now);
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].name, "robot/connect: bridge");
  EXPECT_EQ(all[1].name, "robot/connect: link 1");
  EXPECT_EQ(all[2].name, "robot/connect: link 2");
  for (const auto& one : all) EXPECT_EQ(one.level, Level::kOk) << one.message;
  EXPECT_THAT(all[0].values,
              AllOf(Contains(Pair("loop_lag_ms", "0.0")), Contains(Pair("memory_max_bytes", "100")),
                    Contains(Pair("strangers.accepted", "0"))));
  EXPECT_THAT(all[1].values,
              AllOf(Contains(Pair("clock.round_trip_ms", "30.0")), Contains(Pair("open", "true")),
                    Contains(Pair("node", "/of_anna"))));
}

TEST(Diagnostics, NeitherPeopleNorAddressesLeaveThisMachine) {
  StatusPicture now = picture({7}, Role::kClient);
  now.side.last_failure = {Cause::kConnectionLost, "anna at 203.0.113.5:4 went"};
  StatusPicture lost = now;
  lost.side.links[0].open = false;
  auto all = told(now);
  for (auto& one : told(lost)) all.push_back(std::move(one));
  for (const auto& one : all) {
    EXPECT_THAT(one.message, AllOf(Not(HasSubstr("203.0.113.5")), Not(HasSubstr("anna"))));
    for (const auto& [key, value] : one.values)
      EXPECT_THAT(value, AllOf(Not(HasSubstr("203.0.113.5")), Not(testing::Eq("anna")))) << key;
  }
}

TEST(Diagnostics, WhatIsWorthALook) {
  StatusPicture now = picture({7, 9, 11});
  now.run.loop_lag_ms = 900;
  now.side.shared_bytes = 95;
  now.run.certificate_end = kToday + 3 * kDay;
  now.side.links[0].open = false;
  now.side.links[1].path_queue = std::chrono::milliseconds(2500);
  now.side.links[2].login_end = kToday + kDay / 2;
  const auto all = told(now);
  EXPECT_EQ(all[0].level, Level::kWarn);
  EXPECT_THAT(all[0].message, AllOf(HasSubstr("held up for 900 ms"), HasSubstr("memory_max"),
                                    HasSubstr("the certificate ends in 3 days")));
  EXPECT_THAT(all[0].values, Contains(Pair("certificate_valid_days", "3")));
  EXPECT_THAT(all[1], AllOf(Field(&Diagnostic::level, Level::kWarn),
                            Field(&Diagnostic::message, "lost, may return")));
  EXPECT_EQ(all[2].message, "packets wait 2.5 s on the path");
  EXPECT_EQ(all[3].message, "the login ends in 0 days");
  now.run.certificate_end = kToday;
  EXPECT_EQ(told(now)[0].level, Level::kError);
}

TEST(Diagnostics, WhoDrivesHasNoName) {
  StatusPicture now = picture({7});
  TopicStatus& topic = now.side.links[0].topics.emplace_back();
  topic.topic = "/cmd_vel";
  topic.latency_ms = 20;
  const auto message = [&](WheelState state, bool exported) {
    topic.wheel = state;
    topic.exported = exported;
    const auto all = told(now);
    EXPECT_EQ(all[1].level, Level::kOk);
    EXPECT_THAT(all[1].values, Contains(Pair("last_command_ms", "20.0")));
    return all[1].message;
  };
  EXPECT_EQ(message(WheelState::kYours, true), "you drive");
  EXPECT_EQ(message(WheelState::kYours, false), "somebody drives");
  EXPECT_EQ(message(WheelState::kTaken, true), "another peer drives");
  EXPECT_EQ(message(WheelState::kHalted, true), "halted: let go first");
  EXPECT_EQ(message(WheelState::kFree, false), "nobody drives");
}

TEST(Diagnostics, AnOverloadARefusedFileAndALostRelayAreWorthALook) {
  StatusPicture now = picture({7});
  TopicStatus& topic = now.side.links[0].topics.emplace_back();
  topic.exported = topic.demanded = true;
  topic.origins = 1;
  topic.topic = "/of_anna/image";
  topic.published_for_each_sent = 10;
  EXPECT_EQ(told(now)[0].level, Level::kOk);
  EXPECT_EQ(told(now)[1].level, Level::kWarn);
  EXPECT_EQ(told(now)[1].message, "1 topic overloaded: the link carries less than is published");
  now.run.refused_parameters = {"2026-12-08T00:00:00.000Z", "anna: unknown"};
  EXPECT_EQ(told(now)[0].level, Level::kWarn);
  EXPECT_THAT(told(now)[0].message, AllOf(HasSubstr("refused"), Not(HasSubstr("anna"))));
  now.run.relays = {{"wss://robot@relay:443", 0, {Cause::kNoAnswer, "no answer"}}};
  EXPECT_EQ(told(now)[0].level, Level::kError);
  EXPECT_THAT(told(now)[0].message, HasSubstr("no connection to the relay"));
}

// Nothing is wrong, and no program may take such messages for exact ones.
TEST(Diagnostics, WhatIsNotExactIsSaid) {
  StatusPicture now = picture({7});
  auto& topics = now.side.links[0].topics;
  topics.resize(3);
  topics[0].topic = "/of_anna/image";
  topics[0].sent_as = {Codec::kPictureBase, 0, 40};
  topics[1].sent_as = {Codec::kCloud, 5000};
  topics[2].sent_as = {Codec::kPlanes};
  const Diagnostic link = told(now)[1];
  EXPECT_EQ(link.level, Level::kOk);
  EXPECT_EQ(link.message, "2 topics not exact");
  EXPECT_THAT(link.values, Contains(Pair("not_exact", "points rounded to 5 mm; video, fair")));
  EXPECT_THAT(link.values, Contains(Pair("topics_not_exact", "2")));
  topics.erase(topics.begin(), topics.begin() + 2);
  EXPECT_EQ(told(now)[1].message, "open");
}

TEST(Diagnostics, AClientWithoutALinkSaysWhy) {
  StatusPicture now = picture({}, Role::kClient);
  now.side.last_failure = {Cause::kPortClosed, "wss://robot.example:9090/: refused"};
  const auto all = told(now);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].level, Level::kError);
  EXPECT_EQ(all[0].message, "no link to the server: nobody listens at this address and port");
  EXPECT_EQ(told(picture({1}, Role::kClient))[0].level, Level::kOk);
}

TEST(Diagnostics, APlaceServesAgain) {
  LinkPlaces places;
  StatusPicture now = picture({7, 9});
  places.follow(now.side.links);
  now.side.links.erase(now.side.links.begin());
  places.follow(now.side.links);
  EXPECT_EQ(places.of(now.side.links[0]), 2U);
  now.side.links.push_back(picture({11}).side.links[0]);
  places.follow(now.side.links);
  EXPECT_EQ(places.of(now.side.links[1]), 1U);
}

TEST(Diagnostics, Serialized) {
  const Diagnostic one{Level::kWarn, "n", "me", {{"key", "value"}, {"k", ""}}};
  const Payload message = diagnostic_array({one}, "/node", 5 * kStampSecond + 7);
  CdrReader reader(message.view());
  EXPECT_EQ(reader.u32(), 5U);
  EXPECT_EQ(reader.u32(), 7U);
  EXPECT_EQ(reader.string(), "");
  EXPECT_EQ(reader.u32(), 1U);
  EXPECT_EQ(reader.u8(), 1U);
  EXPECT_EQ(reader.string(), "n");
  EXPECT_EQ(reader.string(), "me");
  EXPECT_EQ(reader.string(), "/node");
  EXPECT_EQ(reader.u32(), 2U);
  for (const char* text : {"key", "value", "k", ""}) EXPECT_EQ(reader.string(), text);
  EXPECT_FALSE(reader.u8());
}

}  // namespace
}  // namespace connect_bridge
