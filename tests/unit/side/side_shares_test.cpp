// What the links of one identity have together, and what they leave to others.
#include <gtest/gtest.h>

#include <algorithm>

#include "unit/side/script.hpp"
#include "unit/topics/one_link.hpp"

namespace connect_bridge::side_test {
namespace {

// The first part of a message of so many bytes, that is never finished.
Bytes begun(std::uint32_t channel, std::uint32_t bytes) {
  MessageFrame frame;
  frame.channel = {channel};
  frame.subject = {1};
  frame.sequence = 1;
  frame.demand = 1;
  frame.raw_bytes = frame.body_bytes = bytes;
  const Bytes part(1000);
  frame.part = part;
  Bytes packet;
  append_header(frame, packet);
  packet.insert(packet.end(), part.begin(), part.end());
  return packet;
}

// A graph does not see more publishers come and go than that, however often their peer logs in.
TEST(Shares, MirrorsAppearAtABoundedRate) {
  SideOptions options = server();
  options.account.mirrors_at_once = 5;
  options.account.mirror_period = std::chrono::milliseconds(20);
  Script s(options);
  s.graph({});
  s.pass(3000);
  s.did();
  std::int64_t made = 0;
  for (std::uint32_t n = 1; n <= 3; ++n) {
    s.login(n, {}, called("busy"));
    s.say(n, Accepts{});
    std::vector<OriginOffer> origins;
    for (std::uint8_t i = 1; i <= 20; ++i)
      origins.push_back(origin(i, static_cast<std::uint8_t>(n * 50 + i)));
    s.say(n, Offer{{channel(1, "/a" + std::to_string(n), origins)}, true});
    made += times(s.did(), "mirror ");
  }
  EXPECT_EQ(made, 5);
  // Others are not held up by that.
  s.login(9, {}, called("calm"));
  s.say(9, Offer{{channel(1, "/calm", {origin(1, 9)})}, true});
  EXPECT_EQ(times(s.did(), "/calm"), 1);
  s.pass(100);
  EXPECT_EQ(times(s.did(), "mirror "), 5);
  s.pass(1000);
  EXPECT_EQ(times(s.did(), "mirror "), 50);
}

// Services count there, too.
TEST(Shares, ServicesAppearAtABoundedRate) {
  SideOptions options = server({callable()});
  options.account.mirrors_at_once = 5;
  options.account.mirror_period = std::chrono::milliseconds(20);
  Script s(options);
  s.graph({});
  s.pass(1500);
  s.did();
  const auto offer = [&](std::uint32_t n, std::uint32_t services, const std::string& name) {
    s.login(n, {}, called(name));
    s.say(n, Accepts{});
    Offer all{{}, true};
    for (std::uint32_t i = 1; i <= services; ++i)
      all.channels.push_back(service_channel(i, "/" + name + std::to_string(i)));
    s.say(n, all);
    for (std::uint32_t i = 1; i <= services; ++i) s.say(n, Attached{{i}, {i}, {0}});
  };
  offer(1, 20, "busy");
  EXPECT_EQ(times(s.did(), "mirror_service "), 5);
  offer(2, 1, "calm");
  EXPECT_EQ(times(s.did(), "/calm1"), 1);
  s.pass(100);
  EXPECT_EQ(times(s.did(), "mirror_service "), 5);
  s.pass(300);
  EXPECT_EQ(times(s.did(), "mirror_service "), 10);
}

// They take places as publishers do, but not theirs; who finds none waits for one.
TEST(Shares, ServicesTakePlaces) {
  SideOptions options = server({callable()});
  options.account.services_max = 16;
  Script s(options);
  s.graph({});
  s.pass(1500);
  s.did();
  s.login(1, {}, called("busy"));
  s.say(1, Accepts{});
  Offer all{{}, true};
  for (std::uint32_t i = 1; i <= 20; ++i)
    all.channels.push_back(service_channel(i, "/s" + std::to_string(i)));
  s.say(1, all);
  for (std::uint32_t i = 1; i <= 20; ++i) s.say(1, Attached{{i}, {i}, {0}});
  const auto made = times(s.did(), "mirror_service ");
  EXPECT_GT(made, 0);
  EXPECT_LT(made, 16);  // an identity leaves places to others
  s.pass(1000);
  EXPECT_EQ(s.did(), "");
  s.say(1, Withdraw{{{1}}});
  s.did();
  s.pass(2000);
  EXPECT_EQ(times(s.did(), "mirror_service "), 1);
}

// Nor do the lines that its peer's words make fill what is told once of others.
TEST(Shares, WhoHasOddNamesSilencesNobody) {
  SideOptions options = server();
  options.mirrors_max = 1;
  options.account.mirrors_at_once = 5000;
  Script s(options);
  s.graph({});
  s.pass(3000);
  const auto offer = [&](std::uint32_t n, const std::string& name, std::uint32_t topics) {
    s.login(n, {}, called(name));
    s.say(n, Accepts{});
    for (std::uint32_t i = 1; i <= topics; ++i) {
      s.say(n, Offer{{channel(i, "/" + name + std::to_string(i), {origin(1, 7), origin(2, 8)})},
                     true});
    }
    s.did();
  };
  offer(1, "odd", 1100);
  EXPECT_EQ(times(s.logged, "no more mirrors"), 1);
  s.logged.clear();
  offer(2, "calm", 1);
  EXPECT_EQ(times(s.logged, "no more mirrors"), 1);
}

// Lines about links that come and go.
TEST(Shares, WhoComesAndGoesFillsNoLog) {
  SideOptions options = server();
  options.account.offences_at_once = 1000;
  Script s(options);
  s.give(TimePassed{});
  s.did();
  s.logged.clear();
  for (std::uint32_t n = 1; n <= 100; ++n) {
    s.login(n, {}, called("restless"));
    s.binary(n, {0, 0, 0, 0, 0, 0, 0, 0});
  }
  s.did();
  EXPECT_EQ(times(s.logged, "\n"), 30) << s.logged;
  s.logged.clear();
  s.login(150, {}, called("calm"));
  s.did();
  EXPECT_EQ(times(s.logged, "as calm"), 1) << s.logged;
  s.pass(5000);
  s.logged.clear();
  s.login(151, {}, called("restless"));
  s.did();
  EXPECT_EQ(times(s.logged, "170 lines like this were left out"), 1) << s.logged;
}

// Of two peers that begin as many large messages as they like each has a part, and what is too much
// is dropped and counted; both links live.
TEST(Shares, MemoryIsSharedByIdentitiesAndByLinks) {
  SideOptions options = server();
  options.account.memory_bytes_max = 120'000'000;
  Script s(options);
  std::vector<Topic> listened;
  for (int i = 1; i <= 4; ++i) listened.push_back(topic("/a" + std::to_string(i)).sub(50));
  s.graph(listened);
  s.pass(3000);
  for (const std::uint32_t n : {1U, 2U, 3U}) {
    s.login(n, {}, called(n < 3 ? "greedy" : "late"));
    s.say(n, Accepts{});
    Offer offer{{}, true};
    for (std::uint32_t i = 1; i <= 4; ++i) {
      const auto gid = static_cast<std::uint8_t>(n * 10 + i);
      offer.channels.push_back(channel(i, "/a" + std::to_string(i), {origin(1, gid)}));
    }
    s.say(n, offer);
    s.pass(2000);
    for (std::uint32_t i = 1; i <= 4; ++i) s.binary(n, begun(i, 15'000'000));
  }
  const Status status = s.status();
  ASSERT_EQ(status.links.size(), 3U);
  EXPECT_EQ(status.links[0].memory_bytes, 45'000'000U);
  EXPECT_EQ(status.links[1].memory_bytes, 15'000'000U);
  EXPECT_EQ(status.links[2].memory_bytes, 30'000'000U);
  EXPECT_EQ(status.shared_bytes, 90'000'000U);
  EXPECT_EQ(status.shared_bytes_max, 120'000'000U);
  for (const auto& link : status.links) EXPECT_TRUE(link.open);
  s.lose(1);
  s.lose(2);
  EXPECT_EQ(s.status().shared_bytes, 30'000'000U);
}

// An identity with many links has no more publishers here than the others leave.
TEST(Shares, PlacesOfMirrorsAreSharedByIdentities) {
  auto options = server();
  options.account.mirrors_max = 12;
  Script s(std::move(options));
  s.graph({});
  s.pass(1000);
  s.did();
  for (std::uint32_t n = 1; n <= 4; ++n) {
    s.login(n, {}, called(n < 4 ? "greedy" : "late"));
    s.say(n, Accepts{});
    std::vector<OriginOffer> origins;
    for (std::uint8_t i = 1; i <= 5; ++i)
      origins.push_back(origin(i, static_cast<std::uint8_t>(n * 10 + i)));
    s.say(n,
          Offer{{channel(1, "/a", n < 4 ? origins : std::vector{origins[0], origins[1]})}, true});
    EXPECT_EQ(times(s.did(), "mirror "), std::vector<std::int64_t>({5, 1, 0, 2})[n - 1]) << n;
  }
}

// Few look in a step, links in turns: each gets a place in the end.
TEST(Shares, HoweverManyLinksWaitForPlacesEachGetsIts) {
  SideOptions options = server();
  options.account.mirrors_max = 400;
  options.account.mirrors_at_once = 5000;
  Script s(options);
  s.graph({});
  s.pass(3000);
  s.did();
  const auto made_after = [&](std::int64_t ms) {
    s.pass(ms);
    const std::string did = s.did();
    return times(did, "mirror ") - times(did, "unmirror ");
  };
  const auto offer = [&](std::uint32_t n, const std::string& name, std::uint32_t topics) {
    s.login(n, {}, called(name));
    s.say(n, Accepts{});
    std::vector<ChannelOffer> all;
    for (std::uint32_t i = 1; i <= topics; ++i)
      all.push_back(channel(i, "/n" + std::to_string(n * 1000 + i), {origin(1, 9)}));
    s.offer(n, all, true);
  };
  offer(1, "calm", 300);
  EXPECT_EQ(made_after(2000), 200);
  for (std::uint32_t n = 2; n <= 5; ++n) offer(n, "busy", 100);
  EXPECT_EQ(made_after(5000), 100);
  s.lose(1);
  EXPECT_EQ(made_after(10'000), 100);
  s.lose(2);
  EXPECT_EQ(made_after(10'000), 100) << "those of the links that are left";
}

// A link has a limit of its own, but who has many links has no more channels than this.
TEST(Shares, ChannelsHaveANumberForAnIdentity) {
  Script s(server({}));  // what no rule allows counts, too
  s.graph({});
  s.pass(1000);
  const auto join = [&](std::uint32_t n, const std::string& name) {
    s.login(n, {}, called(name));
    s.say(n, Accepts{});
    s.said(n);
  };
  constexpr auto kLinks = static_cast<std::uint32_t>(Account::kChannelsMax / Link::kOfferedMax);
  std::vector<ChannelOffer> many;
  for (std::uint32_t i = 1; i <= Link::kOfferedMax; ++i)
    many.push_back(channel(i, "/t" + std::to_string(i), {}));
  for (std::uint32_t n = 1; n <= kLinks; ++n) {
    join(n, "greedy");
    s.offer(n, many, true);
    EXPECT_EQ(times(s.said(n), " limit"), 0) << n;
  }
  const auto answer = [&](std::uint32_t n, std::uint32_t number) {
    s.offer(n, {channel(number, "/more" + std::to_string(number), {})}, true);
    return s.said(n);
  };
  join(kLinks + 1, "greedy");
  join(kLinks + 2, "calm");
  EXPECT_EQ(answer(kLinks + 1, 1), "decline 1 limit\n");
  EXPECT_EQ(answer(kLinks + 2, 1), "decline 1 not_permitted\n");
  s.say(1, Withdraw{{{1}, {2}}});
  EXPECT_EQ(answer(kLinks + 1, 2), "decline 2 not_permitted\n");
  EXPECT_EQ(answer(kLinks + 1, 3), "decline 3 limit\n");
}

// A peer may offer thousands of topics: what is in use is shown, of the others the sum.
TEST(Shares, TheStatusShowsSoManyTopicsOfALink) {
  Script s(server({everything()}));
  std::vector<Topic> topics;
  for (int i = 0; i < 600; ++i) topics.push_back(topic("/t" + std::to_string(i)).pub(1));
  s.graph(topics);
  s.join(1);
  s.pass(1);
  s.demand(1, 600, true);
  const LinkStatus shown = s.status().links.front();
  EXPECT_EQ(shown.topics.size(), LinkStatus::kShownMax);
  EXPECT_EQ(shown.further_topics, 600 - LinkStatus::kShownMax);
  EXPECT_TRUE(shown.topics.front().demanded);
}

}  // namespace
}  // namespace connect_bridge::side_test
