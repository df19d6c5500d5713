#include "core/wire/control.hpp"

#include <gtest/gtest.h>

// Examples and malformed messages are in tests/vectors; here are fields, limits, what is tolerated.
namespace connect_bridge {
namespace {

template <class Message>
Message read(std::string_view text) {
  const auto message = decode_control(text);
  EXPECT_TRUE(message.ok()) << message.error().message;
  if (!message.ok()) return {};
  const auto* value = std::get_if<Message>(&message.value());
  EXPECT_NE(value, nullptr);
  return value == nullptr ? Message{} : *value;
}

CloseCode code_of(std::string_view text) {
  const auto message = decode_control(text);
  return message.ok() ? CloseCode::kNormal : message.error().code;
}

ChannelOffer channel(std::uint32_t number, std::size_t origins = 1) {
  ChannelOffer offer;
  offer.channel.value = number;
  offer.name = "/topic";
  offer.type = "std_msgs/msg/String";
  for (std::uint32_t i = 1; i <= origins; ++i) {
    OriginOffer origin;
    origin.origin.value = i;
    origin.node = "/node";
    offer.origins.push_back(origin);
  }
  return offer;
}

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

// `count` copies of `item` between `before` and `after`.
std::string list(std::string before, std::size_t count, std::string_view item,
                 std::string_view after) {
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) before += ',';
    before += item;
  }
  return before.append(after);
}

TEST(Control, LimitsAreInclusiveAndBeyondThemIsTooLarge) {
  const auto withdraw = [](std::size_t n) {
    return list(R"({"type":"withdraw","channels":[)", n, "1", "]}");
  };
  EXPECT_EQ(code_of(withdraw(kChannelIdsMax)), CloseCode::kNormal);
  EXPECT_EQ(code_of(withdraw(kChannelIdsMax + 1)), CloseCode::kTooLarge);

  const auto offer = [](std::size_t n) {
    return list(R"({"type":"offer","channels":[)", n, R"({"channel":1,"kind":"x","name":""})",
                "]}");
  };
  EXPECT_EQ(code_of(offer(kOfferChannelsMax)), CloseCode::kNormal);
  EXPECT_EQ(code_of(offer(kOfferChannelsMax + 1)), CloseCode::kTooLarge);

  const auto origins = [](std::size_t n) { return encode(Offer{{channel(1, n)}, true}); };
  EXPECT_EQ(code_of(origins(kChannelOriginsMax)), CloseCode::kNormal);
  EXPECT_EQ(code_of(origins(kChannelOriginsMax + 1)), CloseCode::kTooLarge);

  const auto rules = [](std::size_t n) {
    return list(R"({"type":"accepts","deny":[],"rules":[)", n, R"({"topics":[],"types":[]})", "]}");
  };
  EXPECT_EQ(code_of(rules(kAcceptRulesMax)), CloseCode::kNormal);
  EXPECT_EQ(code_of(rules(kAcceptRulesMax + 1)), CloseCode::kTooLarge);

  for (const auto* before : {R"({"type":"forget","channel":1,"calls":[)",
                             R"({"type":"refuse","channel":1,"code":"limit","calls":[)",
                             R"({"type":"attached","channel":1,"requests":1,"calls":[)"}) {
    EXPECT_EQ(code_of(list(before, kCallIdsMax, "1", "]}")), CloseCode::kNormal) << before;
    EXPECT_EQ(code_of(list(before, kCallIdsMax + 1, "1", "]}")), CloseCode::kTooLarge) << before;
  }

  for (const auto* key : {"services", "actions", "parameters"}) {
    const auto patterns = [&](std::size_t n) {
      return list(R"({"type":"accepts","deny":[],"rules":[{"topics":[],"types":[],")" +
                      std::string{key} + "\":[",
                  n, R"("/a")", "]}]}");
    };
    EXPECT_EQ(code_of(patterns(kPatternsMax)), CloseCode::kNormal) << key;
    EXPECT_EQ(code_of(patterns(kPatternsMax + 1)), CloseCode::kTooLarge) << key;
  }

  const auto deny = [](std::size_t n) {
    return list(R"({"type":"accepts","rules":[],"deny":[)", n, R"("/a")", "]}");
  };
  EXPECT_EQ(code_of(deny(kPatternsMax)), CloseCode::kNormal);
  EXPECT_EQ(code_of(deny(kPatternsMax + 1)), CloseCode::kTooLarge);
}

TEST(Control, WholeMessageHasLimitsOfBytesValuesAndDepth) {
  std::string text = R"({"type":"withdraw","channels":[]})";
  text.append(kControlBytesMax - text.size(), ' ');
  EXPECT_EQ(code_of(text), CloseCode::kNormal);
  EXPECT_EQ(code_of(text + ' '), CloseCode::kTooLarge);

  const std::string ignored = R"({"type":"withdraw","channels":[],"x":[)";
  for (const char* value : {"0", "[]", "{ }", R"("[")"}) {  // beside four others
    EXPECT_EQ(code_of(list(ignored, kControlValuesMax - 4, value, "]}")), CloseCode::kNormal);
    EXPECT_EQ(code_of(list(ignored, kControlValuesMax - 3, value, "]}")), CloseCode::kTooLarge);
  }

  const auto nested = [](std::size_t depth) {
    return R"({"type":"withdraw","channels":[],"x":)" + std::string(depth - 1, '[') +
           std::string(depth - 1, ']') + "}";
  };
  EXPECT_EQ(code_of(nested(kControlDepthMax)), CloseCode::kNormal);
  EXPECT_EQ(code_of(nested(kControlDepthMax + 1)), CloseCode::kTooLarge);
  // Brackets in strings nest nothing.
  EXPECT_EQ(code_of(R"({"type":"withdraw","channels":[],"x":"[[[[[[\"[[[[[[\\"})"),
            CloseCode::kNormal);
}

TEST(Control, OffersAreSplitToFitAndOnlyTheLastIsComplete) {
  EXPECT_TRUE(encode_offers({}, false).empty());
  const auto nothing = encode_offers({}, true);
  ASSERT_EQ(nothing.size(), 1U);
  EXPECT_TRUE(read<Offer>(nothing[0]).complete);
  EXPECT_TRUE(read<Offer>(nothing[0]).channels.empty());

  std::vector<ChannelOffer> channels;
  for (std::uint32_t i = 1; i <= 300; ++i) {
    channels.push_back(channel(i, i % 100 == 0 ? kChannelOriginsMax : 2));
  }
  const auto texts = encode_offers(channels, true);
  std::uint32_t next = 1;
  for (const auto& text : texts) {
    const auto offer = read<Offer>(text);
    EXPECT_EQ(offer.complete, &text == &texts.back());
    for (const auto& got : offer.channels) EXPECT_EQ(got.channel.value, next++);
    // A thin link carries it well within `dead_after`.
    EXPECT_TRUE(text.size() < 17'000 || offer.channels.size() == 1) << text.size();
  }
  EXPECT_EQ(next, 301U);
  EXPECT_FALSE(read<Offer>(encode_offers({channel(1)}, false)[0]).complete);
}

TEST(Control, ChannelWithTheMostOriginsAndTheLongestNamesFits) {
  ChannelOffer largest = channel(1, kChannelOriginsMax);
  largest.name = "/" + std::string(kNameBytesMax - 1, 'n');
  for (auto& origin : largest.origins) {
    origin.origin.value = 0xffffffff;
    origin.node.assign(kNameBytesMax, 'n');
    origin.qos = {Reliability::kBestEffort,
                  Durability::kTransientLocal,
                  History::kKeepLast,
                  0xffffffff,
                  kDurationMax,
                  kDurationMax,
                  Liveliness::kManualByTopic,
                  kDurationMax};
  }
  EXPECT_EQ(code_of(encode_offers({largest}, true).at(0)), CloseCode::kNormal);
}

}  // namespace
}  // namespace connect_bridge
