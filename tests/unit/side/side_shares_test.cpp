// What the links of one identity have together, and what they leave to others.
#include <gtest/gtest.h>

#include <algorithm>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

std::int64_t count(const std::string& text, const std::string& of) {
  std::int64_t found = 0;
  for (std::size_t at = text.find(of); at != std::string::npos; at = text.find(of, at + 1)) ++found;
  return found;
}

Identity called(const std::string& name) {
  Identity who;
  who.name = name;
  return who;
}

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
    made += count(s.did(), "mirror ");
  }
  EXPECT_EQ(made, 5);
  // Others are not held up by that.
  s.login(9, {}, called("calm"));
  s.say(9, Offer{{channel(1, "/calm", {origin(1, 9)})}, true});
  EXPECT_EQ(count(s.did(), "/calm"), 1);
  s.pass(100);
  EXPECT_EQ(count(s.did(), "mirror "), 5);
  s.pass(1000);
  EXPECT_EQ(count(s.did(), "mirror "), 50);
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
  EXPECT_EQ(count(s.logged, "\n"), 30) << s.logged;
  s.logged.clear();
  s.login(150, {}, called("calm"));
  s.did();
  EXPECT_EQ(count(s.logged, "as calm"), 1) << s.logged;
  s.pass(5000);
  s.logged.clear();
  s.login(151, {}, called("restless"));
  s.did();
  EXPECT_EQ(count(s.logged, "170 lines like this were left out"), 1) << s.logged;
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

}  // namespace
}  // namespace connect_bridge::side_test
