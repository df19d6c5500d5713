// The limits of control messages: what is beyond them is refused, and what is said keeps to them.
#include <gtest/gtest.h>

#include "core/wire/control.hpp"
#include "unit/wire/controls.hpp"

namespace connect_bridge {
namespace {

using namespace control_test;

// `count` copies of `item` between `before` and `after`.
std::string list(std::string before, std::size_t count, std::string_view item,
                 std::string_view after) {
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) before += ',';
    before += item;
  }
  return before.append(after);
}

TEST(ControlLimits, LimitsAreInclusiveAndBeyondThemIsTooLarge) {
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
  EXPECT_EQ(code_of(origins(kAddedMax)), CloseCode::kNormal);
  EXPECT_EQ(code_of(origins(kAddedMax + 1)), CloseCode::kTooLarge);
  const auto added = [](std::size_t n) {
    return encode(OriginsChanged{{1}, channel(1, n).origins, {}});
  };
  EXPECT_EQ(code_of(added(kAddedMax)), CloseCode::kNormal);
  EXPECT_EQ(code_of(added(kAddedMax + 1)), CloseCode::kTooLarge);
  const ListenerReport listener{{1}, "/a", "p/msg/A", ""};
  const auto listeners = [&](std::size_t n) { return encode(Listeners{{n, listener}, {}}); };
  EXPECT_EQ(code_of(listeners(kAddedMax)), CloseCode::kNormal);
  EXPECT_EQ(code_of(listeners(kAddedMax + 1)), CloseCode::kTooLarge);
  for (const auto* before : {R"({"type":"origins","channel":1,"added":[],"removed":[)",
                             R"({"type":"listeners","added":[],"removed":[)"}) {
    EXPECT_EQ(code_of(list(before, kRemovedMax, "1", "]}")), CloseCode::kNormal) << before;
    EXPECT_EQ(code_of(list(before, kRemovedMax + 1, "1", "]}")), CloseCode::kTooLarge) << before;
  }

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
    EXPECT_EQ(code_of(patterns(kAcceptEntriesMax)), CloseCode::kNormal) << key;
    EXPECT_EQ(code_of(patterns(kAcceptEntriesMax + 1)), CloseCode::kTooLarge) << key;
  }

  const auto deny = [](std::size_t n) {
    return list(R"({"type":"accepts","rules":[],"deny":[)", n, R"("/a")", "]}");
  };
  EXPECT_EQ(code_of(deny(kAcceptEntriesMax)), CloseCode::kNormal);
  EXPECT_EQ(code_of(deny(kAcceptEntriesMax + 1)), CloseCode::kTooLarge);
}

TEST(ControlLimits, AcceptsHasFewAndShortWildcards) {
  // A type with a star is no pattern.
  const auto wild = [](std::size_t topics, std::size_t denied, const std::string& text) {
    const std::vector<std::string> names(topics, text);
    return encode(Accepts{{{names, {"p/msg/*"}}}, std::vector<std::string>(denied, text)});
  };
  EXPECT_EQ(code_of(wild(kWildcardsMax - 6, 6, "/a/*")), CloseCode::kNormal);
  EXPECT_EQ(code_of(wild(kWildcardsMax - 6, 7, "/a/*")), CloseCode::kTooLarge);
  const std::string of_32 = "/long/before/*" + std::string(31, 'b');
  EXPECT_EQ(code_of(wild(100, kWildcardBytesMax / 32 - 100, of_32)), CloseCode::kNormal);
  EXPECT_EQ(code_of(wild(100, kWildcardBytesMax / 32 - 99, of_32)), CloseCode::kTooLarge);
}

TEST(ControlLimits, WholeMessageHasLimitsOfBytesValuesAndDepth) {
  std::string text = R"({"type":"withdraw","channels":[]})";
  text.append(kControlBytesMax - text.size(), ' ');
  EXPECT_EQ(code_of(text), CloseCode::kNormal);
  EXPECT_EQ(code_of(text + ' '), CloseCode::kTooLarge);

  // Named or not: what is skipped counts, too.
  for (const std::string before : {R"({"type":"withdraw","channels":[],"x":[)",
                                   R"({"type":"withdraw","channels":[],"rules":[)"})
    for (const char* value : {"0", "[]", "{ }", R"("[")"}) {  // beside four others
      EXPECT_EQ(code_of(list(before, kControlValuesMax - 4, value, "]}")), CloseCode::kNormal);
      EXPECT_EQ(code_of(list(before, kControlValuesMax - 3, value, "]}")), CloseCode::kTooLarge);
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

TEST(ControlLimits, AnObjectHasALimitOfMembers) {
  const auto with_members = [](std::size_t n) {
    std::string text = R"({"type":"withdraw","channels":[])";
    for (std::size_t i = 2; i < n; ++i) text += ",\"x" + std::to_string(i) + "\":0";
    return text + "}";
  };
  EXPECT_EQ(code_of(with_members(kControlMembersMax)), CloseCode::kNormal);
  EXPECT_EQ(code_of(with_members(kControlMembersMax + 1)), CloseCode::kTooLarge);
  EXPECT_EQ(code_of(with_members(20'000)), CloseCode::kTooLarge);
  // Also of one that is skipped, and of one member again and again.
  EXPECT_EQ(code_of(list(R"({"type":"withdraw","channels":[],"x":[{)", kControlMembersMax + 1,
                         R"("y":0)", "}]}")),
            CloseCode::kTooLarge);
  EXPECT_EQ(code_of(list(R"({"type":"withdraw",)", kControlMembersMax, R"("channels":[])", "}")),
            CloseCode::kTooLarge);
}

TEST(ControlLimits, LongListsAreSaidInParts) {
  std::vector<ChannelId> channels;
  std::vector<CallId> calls;
  for (std::uint32_t i = 1; i <= 10'000; ++i) {
    channels.push_back({i});
    calls.push_back({i});
  }
  std::vector<ChannelId> got;
  for (const auto& text : encode_parts(Withdraw{channels, "type_unknown", "no"})) {
    const auto part = read<Withdraw>(text);
    got.insert(got.end(), part.channels.begin(), part.channels.end());
    EXPECT_EQ(part.code, "type_unknown");
  }
  EXPECT_EQ(got, channels);

  Demand demand;
  for (std::uint32_t i = 1; i <= 10'000; ++i)
    demand.channels.push_back({.channel = {i}, .number = 3, .resume = true, .after = i * 7});
  std::uint32_t next = 0;
  for (const auto& text : encode_parts(demand)) {
    for (const auto& part : read<Demand>(text).channels) {
      EXPECT_EQ(part.channel.value, ++next);
      EXPECT_EQ(part.number, 3U);
      EXPECT_TRUE(part.resume);
      EXPECT_EQ(part.after, next * 7);
    }
  }
  EXPECT_EQ(next, 10'000U);

  std::vector<CallId> got_calls;
  for (const auto& text : encode_parts(Forget{{1}, calls})) {
    const auto part = read<Forget>(text);
    got_calls.insert(got_calls.end(), part.calls.begin(), part.calls.end());
  }
  EXPECT_EQ(got_calls, calls);
  EXPECT_EQ(encode_parts(Refuse{{1}, calls, "limit", ""}).size(), 2U);
  // One with an empty list says something, too.
  EXPECT_EQ(encode_parts(Demand{}), std::vector<std::string>{encode(Demand{})});
}

TEST(ControlLimits, OfAChangeInPartsTheFirstRemoves) {
  const auto texts =
      encode_parts(OriginsChanged{{3}, channel(1, 2 * kAddedMax + 1).origins, {{8}}});
  ASSERT_EQ(texts.size(), 3U);
  std::uint32_t next = 1;
  for (const auto& text : texts) {
    const auto part = read<OriginsChanged>(text);
    EXPECT_EQ(part.channel.value, 3U);
    EXPECT_EQ(part.removed.size(), &text == &texts.front() ? 1U : 0U);
    for (const auto& origin : part.added) EXPECT_EQ(origin.origin.value, next++);
  }
  EXPECT_EQ(next, 2 * kAddedMax + 2);
}

TEST(ControlLimits, OffersAreSplitToFitAndOnlyTheLastIsComplete) {
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
  std::size_t origins = 0;
  for (const auto& text : texts) {
    // A thin link carries it well within `dead_after`.
    EXPECT_LT(text.size(), 17'000U);
    if (text.starts_with(R"({"type":"origins")")) {
      const auto more = read<OriginsChanged>(text);
      EXPECT_EQ(more.channel.value, next - 1) << "directly behind its offer";
      origins += more.added.size();
      continue;
    }
    const auto offer = read<Offer>(text);
    EXPECT_EQ(offer.complete, &text == &texts.back());
    for (const auto& got : offer.channels) {
      EXPECT_EQ(got.channel.value, next++);
      origins += got.origins.size();
    }
  }
  EXPECT_EQ(next, 301U);
  EXPECT_EQ(origins, 3 * kChannelOriginsMax + 297 * 2);
  EXPECT_FALSE(read<Offer>(encode_offers({channel(1)}, false)[0]).complete);
}

TEST(ControlLimits, TheLongestOriginsAndListenersFit) {
  const std::string name = "/" + std::string(kNameBytesMax - 1, '"');
  const Qos qos{Reliability::kBestEffort,
                Durability::kTransientLocal,
                History::kKeepLast,
                0xffffffff,
                kDurationMax,
                kDurationMax,
                Liveliness::kManualByTopic,
                kDurationMax};
  ChannelOffer largest = channel(1, kChannelOriginsMax);
  largest.name = largest.type = largest.type_hash = name;
  for (auto& origin : largest.origins) origin = {{0xffffffff}, {}, name, qos};
  for (const auto& text : encode_offers({largest}, true))
    EXPECT_EQ(code_of(text), CloseCode::kNormal);
  Listeners listeners{{}, std::vector<ListenerId>(kRemovedMax, {0xffffffff})};
  listeners.added.assign(kListenersMax, {{0xffffffff}, name, name, name});
  for (const auto& text : encode_parts(listeners)) EXPECT_EQ(code_of(text), CloseCode::kNormal);
}

// As many as a link may have.
TEST(ControlLimits, TheLongestListOfCallsFits) {
  const Attached attached{{1}, {1}, {0xffffffff}, std::vector<CallId>(kCallIdsMax, {0xffffffff})};
  EXPECT_EQ(code_of(encode(attached)), CloseCode::kNormal);
}

}  // namespace
}  // namespace connect_bridge
