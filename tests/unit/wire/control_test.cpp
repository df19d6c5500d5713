#include "core/wire/control.hpp"

#include <gtest/gtest.h>

#include "unit/wire/controls.hpp"

// Examples and malformed messages are in tests/vectors; here are fields, and what is tolerated;
// limits are in control_limits_test.cpp.
namespace connect_bridge {
namespace {

using namespace control_test;

TEST(Control, OfferKeepsEveryField) {
  ChannelOffer sent = channel(7);
  sent.kind = InterfaceKind::kTopic;
  sent.type_hash = "RIHS01_00";
  sent.priority = Priority::kUrgent;
  sent.newest_only = true;
  sent.origins[0].gid.bytes = {0x01, 0x0f, 0xab};
  sent.origins[0].qos = {Reliability::kBestEffort,
                         Durability::kTransientLocal,
                         History::kKeepAll,
                         5,
                         std::chrono::milliseconds(1),
                         Duration::zero(),
                         Liveliness::kManualByTopic,
                         kDurationMax};

  const auto offer = read<Offer>(encode(Offer{{sent}, true}));

  EXPECT_TRUE(offer.complete);
  ASSERT_EQ(offer.channels.size(), 1U);
  const ChannelOffer& got = offer.channels[0];
  EXPECT_EQ(got.channel, sent.channel);
  EXPECT_EQ(got.kind, sent.kind);
  EXPECT_EQ(got.name, sent.name);
  EXPECT_EQ(got.type, sent.type);
  EXPECT_EQ(got.type_hash, sent.type_hash);
  EXPECT_EQ(got.priority, sent.priority);
  EXPECT_TRUE(got.newest_only);
  ASSERT_EQ(got.origins.size(), 1U);
  EXPECT_EQ(got.origins[0].origin, sent.origins[0].origin);
  EXPECT_EQ(got.origins[0].gid, sent.origins[0].gid);
  EXPECT_EQ(got.origins[0].node, "/node");
  EXPECT_EQ(got.origins[0].qos, sent.origins[0].qos);
}

TEST(Control, AbsentDurationIsForever) {
  Qos qos;
  qos.deadline = Duration{-1};                // no duration at all
  qos.lifespan = kDurationMax + Duration{1};  // longer than the wire can say
  ChannelOffer sent = channel(1);
  sent.origins[0].qos = qos;
  const std::string text = encode(Offer{{sent}, false});
  EXPECT_EQ(text.find("_ns"), std::string::npos);
  const auto got = read<Offer>(text).channels[0].origins[0].qos;
  EXPECT_EQ(got.deadline, kForever);
  EXPECT_EQ(got.lifespan, kForever);
  EXPECT_EQ(got.liveliness_lease, kForever);
}

TEST(Control, OriginsWithdrawDemandAcceptsDeclineKeepEveryField) {
  const auto changed =
      read<OriginsChanged>(encode(OriginsChanged{{3}, channel(1, 2).origins, {{8}, {9}}}));
  EXPECT_EQ(changed.channel.value, 3U);
  EXPECT_EQ(changed.added.size(), 2U);
  EXPECT_EQ(changed.removed, (std::vector<OriginId>{{8}, {9}}));

  const auto withdraw = read<Withdraw>(encode(Withdraw{{{1}, {2}}, "type_unknown", "no"}));
  EXPECT_EQ(withdraw.channels.size(), 2U);
  EXPECT_EQ(withdraw.code, "type_unknown");
  EXPECT_EQ(withdraw.reason, "no");
  EXPECT_EQ(encode(Withdraw{{{1}}}), R"({"type":"withdraw","channels":[1]})");

  const auto demand = read<Demand>(encode(Demand{{{1}}, 65535}));
  EXPECT_EQ(demand.number, 65535U);
  EXPECT_EQ(demand.channels, std::vector<ChannelId>{{1}});
  EXPECT_FALSE(demand.resume);
  EXPECT_TRUE(demand.after.empty());
  const auto resumed = read<Demand>(encode(Demand{{{1}, {2}}, 1, true, {0, 4'294'967'295}}));
  EXPECT_TRUE(resumed.resume);
  EXPECT_EQ(resumed.after, (std::vector<std::uint32_t>{0, 4'294'967'295}));

  const auto accepts = read<Accepts>(encode(Accepts{{{{"/a", "/b"}, {"a/msg/A"}}}, {"/c"}}));
  ASSERT_EQ(accepts.rules.size(), 1U);
  EXPECT_EQ(accepts.rules[0].topics, (std::vector<std::string>{"/a", "/b"}));
  EXPECT_EQ(accepts.rules[0].types, std::vector<std::string>{"a/msg/A"});
  EXPECT_EQ(accepts.deny, std::vector<std::string>{"/c"});
  EXPECT_EQ(accepts.message_bytes_max, 0U);
  EXPECT_EQ(read<Accepts>(encode(Accepts{{}, {}, 4'000'000'000})).message_bytes_max,
            4'000'000'000U);

  EXPECT_FALSE(accepts.ros_time);
  EXPECT_TRUE(read<Accepts>(encode(Accepts{{}, {}, 0, true})).ros_time);

  const auto decline = read<Decline>(encode(Decline{{5}, "qos", "no"}));
  EXPECT_EQ(decline.channel.value, 5U);
  EXPECT_EQ(decline.code, "qos");
  EXPECT_EQ(decline.reason, "no");
}

TEST(Control, UnknownKeysAreIgnoredAndOptionalOnesMayBeAbsent) {
  const auto offer = read<Offer>(
      R"({"type":"offer","later":{"x":[1,null]},"channels":[{"channel":1,"kind":"topic",
          "name":"/a","type":"a/msg/A","later":1,"origins":[{"origin":1,
          "gid":"000000000000000000000000000000000000000000000000","qos":{"later":"x"}}]}]})");
  EXPECT_FALSE(offer.complete);
  ASSERT_EQ(offer.channels.size(), 1U);
  EXPECT_EQ(offer.channels[0].priority, Priority::kNormal);
  EXPECT_EQ(offer.channels[0].type_hash, "");
  EXPECT_FALSE(offer.channels[0].newest_only);
  EXPECT_EQ(offer.channels[0].origins[0].qos, Qos{});
}

TEST(Control, ChannelOfALaterKindIsReadAsFarAsItCanBeDeclined) {
  const auto offer = read<Offer>(
      R"({"type":"offer","channels":[{"channel":9,"kind":"blob","name":"/b","origins":"none"}]})");
  ASSERT_EQ(offer.channels.size(), 1U);
  EXPECT_EQ(offer.channels[0].kind, InterfaceKind::kOther);
  EXPECT_EQ(offer.channels[0].channel.value, 9U);
  EXPECT_EQ(offer.channels[0].name, "/b");
}

TEST(Control, AnActionIsAKindThatIsReadAsFarAsItCanBeDeclined) {
  const auto offer = read<Offer>(
      R"({"type":"offer","channels":[{"channel":9,"kind":"action","name":"/b","type":null}]})");
  ASSERT_EQ(offer.channels.size(), 1U);
  EXPECT_EQ(offer.channels[0].kind, InterfaceKind::kAction);
  EXPECT_EQ(offer.channels[0].name, "/b");
}

TEST(Control, AServiceIsOfferedWithItsNodeAndEpochAndNothingOfATopic) {
  ChannelOffer sent;
  sent.channel = {7};
  sent.kind = InterfaceKind::kService;
  sent.name = "/fib/_action/cancel_goal";
  sent.type = "action_msgs/srv/CancelGoal";
  sent.action_type = "p/action/Fibonacci";
  sent.priority = Priority::kHigh;
  sent.node = "/planner";
  sent.epoch = 0xffffffff;
  const std::string text = encode(Offer{{sent}, false});
  EXPECT_EQ(text.find("origins"), std::string::npos);
  const auto got = read<Offer>(text).channels.at(0);
  EXPECT_EQ(got.kind, InterfaceKind::kService);
  EXPECT_EQ(got.type, sent.type);
  EXPECT_EQ(got.action_type, sent.action_type);
  EXPECT_EQ(got.priority, sent.priority);
  EXPECT_EQ(got.node, sent.node);
  EXPECT_EQ(got.epoch, sent.epoch);

  // The least that may be said; what belongs to topics is not looked at.
  const auto least = read<Offer>(R"({"type":"offer","channels":[{"channel":1,"kind":"service",
      "name":"/s","type":"a/srv/A","epoch":1,"origins":5,"newest_only":null}]})")
                         .channels.at(0);
  EXPECT_EQ(least.node, "");
  EXPECT_EQ(least.action_type, "");
  EXPECT_EQ(least.priority, Priority::kNormal);
}

TEST(Control, CallsKeepEveryField) {
  const auto attach = read<Attach>(encode(Attach{{7}, {3}}));
  EXPECT_EQ(attach.channel.value, 7U);
  EXPECT_EQ(attach.requests.value, 3U);

  const auto attached = read<Attached>(encode(Attached{{7}, {3}, {41}, {{40}, {41}}, "RIHS01_0"}));
  EXPECT_EQ(attached.channel.value, 7U);
  EXPECT_EQ(attached.requests.value, 3U);
  EXPECT_EQ(attached.seen.value, 41U);
  EXPECT_EQ(attached.calls, (std::vector<CallId>{{40}, {41}}));
  EXPECT_EQ(attached.type_hash, "RIHS01_0");
  const auto least = read<Attached>(R"({"type":"attached","channel":7,"requests":3,"calls":[]})");
  EXPECT_FALSE(least.seen);
  EXPECT_EQ(least.type_hash, "");

  const auto refuse = read<Refuse>(encode(Refuse{{7}, {{1}, {2}}, "limit", "no room"}));
  EXPECT_EQ(refuse.channel.value, 7U);
  EXPECT_EQ(refuse.calls, (std::vector<CallId>{{1}, {2}}));
  EXPECT_EQ(refuse.code, "limit");
  EXPECT_EQ(refuse.reason, "no room");

  const auto forget = read<Forget>(encode(Forget{{7}, {{0xffffffff}}}));
  EXPECT_EQ(forget.channel.value, 7U);
  EXPECT_EQ(forget.calls, std::vector<CallId>{{0xffffffff}});
}

TEST(Control, PatternsOfEveryKindAreKept) {
  AcceptedNames names;
  names.topics = {"/t"};
  names.services = {"/s", "/s2"};
  names.actions = {"/a"};
  names.parameters = {"/n/**"};
  const auto accepts = read<Accepts>(encode(Accepts{{names, {}}, {}}));
  ASSERT_EQ(accepts.rules.size(), 2U);
  EXPECT_EQ(accepts.rules[0].topics, names.topics);
  EXPECT_EQ(accepts.rules[0].services, names.services);
  EXPECT_EQ(accepts.rules[0].actions, names.actions);
  EXPECT_EQ(accepts.rules[0].parameters, names.parameters);
  EXPECT_TRUE(accepts.rules[1].services.empty());
}

TEST(Control, InvalidUtf8IsRefused) {
  EXPECT_EQ(code_of("{\"type\":\"decline\",\"channel\":1,\"code\":\"qos\",\"reason\":\"\xff\"}"),
            CloseCode::kMalformed);
  EXPECT_EQ(code_of("{\"type\":\"withdraw\",\"channels\":[],\"\xc0\xaf\":1}"),
            CloseCode::kMalformed);
}

TEST(Control, TextOfAPersonIsCleanedAndCutInsteadOfThrowing) {
  const auto decline =
      read<Decline>(encode(Decline{{1}, "failed", "rcl: \xff\n" + std::string(2000, 'x')}));
  EXPECT_EQ(decline.reason.substr(0, 8), "rcl: ??x");
  EXPECT_EQ(decline.reason.size(), kReasonBytesMax);
  ChannelOffer broken = channel(1);
  broken.name = "/\xff";
  EXPECT_FALSE(encode(Offer{{broken}, true}).empty());
}

TEST(Control, WhatIsSkippedEndsWhereItsValueEnds) {
  for (const char* value :
       {"0", "-1", "1.5", "true", "null", R"("}")", "{}", "[]", R"([{"channels":[9]}])",
        R"({"channels":[9],"later":{"type":"demand"}})"}) {
    const auto withdraw =
        read<Withdraw>(R"({"later":)" + std::string{value} + R"(,"type":"withdraw","x":)" + value +
                       R"(,"channels":[1,2],"y":)" + value + "}");
    EXPECT_EQ(withdraw.channels, (std::vector<ChannelId>{{1}, {2}})) << value;
  }
}

TEST(Control, OfAMemberThatIsThereTwiceTheLastOneCounts) {
  EXPECT_EQ(
      read<Withdraw>(R"({"type":"demand","type":"withdraw","channels":5,"channels":[2]})").channels,
      std::vector<ChannelId>{{2}});
}

TEST(Control, EscapesAreReadAndNumbersMustBePlain) {
  EXPECT_EQ(
      read<Decline>(R"({"type":"decl\u0069ne","channel":1,"code":"qos","reason":"\u00e9\"\\"})")
          .reason,
      "\xc3\xa9\"\\");
  for (const char* number : {"-1", "1.0", "1e0", "true", "\"1\"", "[1]", "null"})
    EXPECT_EQ(code_of(R"({"type":"withdraw","channels":[)" + std::string{number} + "]}"),
              CloseCode::kMalformed)
        << number;
}

}  // namespace
}  // namespace connect_bridge
