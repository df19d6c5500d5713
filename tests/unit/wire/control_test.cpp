#include "core/wire/control.hpp"

#include <gtest/gtest.h>

#include "unit/wire/controls.hpp"

// Every field and malformed messages are in tests/vectors; here is what is tolerated; limits are in
// control_limits_test.cpp.
namespace connect_bridge {
namespace {

using namespace control_test;

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

  sent.origins[0].qos.deadline = Duration::zero();
  sent.origins[0].qos.lifespan = kDurationMax;
  const auto extremes = read<Offer>(encode(Offer{{sent}, false})).channels[0].origins[0].qos;
  EXPECT_EQ(extremes.deadline, Duration::zero());
  EXPECT_EQ(extremes.lifespan, kDurationMax);
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

TEST(Control, OfAServiceWhatBelongsToTopicsIsNotLookedAt) {
  const auto least = read<Offer>(R"({"type":"offer","channels":[{"channel":1,"kind":"service",
      "name":"/s","type":"a/srv/A","epoch":1,"origins":5,"newest_only":null}]})")
                         .channels.at(0);
  EXPECT_EQ(least.node, "");
  EXPECT_EQ(least.action_type, "");
  EXPECT_EQ(least.priority, Priority::kNormal);
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

TEST(Control, FormsThatADemandNamesAndALaterVersionKnowsAreLeftOut) {
  const auto demand = read<Demand>(R"({"type":"demand","channels":[
      {"channel":1,"number":1,"decodes":["h264","planes","VP8","planes"]},
      {"channel":2,"number":1,"decodes":["vp8","cloud"],"lossy":true},
      {"channel":3,"number":1,"decodes":[]}]})");
  const Decodes planes{.planes = true};
  EXPECT_EQ(demand.channels.at(0).decodes, planes);
  EXPECT_FALSE(demand.channels.at(0).lossy);
  const Decodes both{.vp8 = true, .cloud = true};
  EXPECT_EQ(demand.channels.at(1).decodes, both);
  EXPECT_TRUE(demand.channels.at(1).lossy);
  EXPECT_EQ(demand.channels.at(2).decodes, Decodes{});
  EXPECT_TRUE(may_answer(planes, Codec::kPlanes));
  EXPECT_FALSE(may_answer(planes, Codec::kCloud));
  EXPECT_TRUE(may_answer(both, Codec::kPictureBase) && may_answer(both, Codec::kPictureDelta));
  EXPECT_TRUE(may_answer(both, Codec::kCloud));
  EXPECT_FALSE(may_answer(both, Codec::kPlanes));
  EXPECT_TRUE(may_answer({}, Codec::kNone) && may_answer({}, Codec::kZstdDelta));
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
