// What an operator reads: one line for each cause, on both sides.
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "unit/side/action.hpp"
#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

constexpr char kUnknown[] = "the type p/action/Fib is not known here";

ChannelOffer part(ChannelOffer offer, const std::string& type) {
  offer.type = type;
  offer.action_type = "p/action/Fib";
  return offer;
}

TEST(Lines, AnActionWhoseTypeThePeerLacksIsOne) {
  Script s(server({acting()}));
  serve_action(s);
  s.join(1);
  s.did();
  s.logged.clear();
  for (std::uint32_t channel = 1; channel <= 5; ++channel)
    s.say(1, Decline{{channel}, "type_unknown", kUnknown});
  s.did();
  EXPECT_EQ(s.logged, std::string("/peer at 10.0.0.1 does not import the action /fib, and says: ") +
                          kUnknown + " (type_unknown)\n");
}

TEST(Lines, AnActionWhoseTypeIsMissingHereIsOne) {
  Script s(server({acting()}));
  s.graph({});
  s.pass(1000);
  s.join(1);
  s.say(1, Offer{{part(channel(1, "/fib/_action/feedback", {origin(1, 11)}),
                       "p/action/Fib_FeedbackMessage"),
                  part(service_channel(2, "/fib/_action/send_goal"), "p/action/Fib_SendGoal")},
                 true});
  s.say(1, Attached{{2}, {1}, {0}});
  s.did();
  s.logged.clear();
  s.give(MirrorFailed{{2}, "type_unknown", kUnknown});
  s.give(ServiceMirrorFailed{{1}, "type_unknown", kUnknown});
  s.did();
  EXPECT_EQ(s.logged, std::string("cannot mirror the action /fib: ") + kUnknown + "\n");
}

TEST(Lines, APeersWordsAreToldAsItsOwn) {
  Script s(server());
  s.graph({topic("/a").pub(1)});
  s.join(1);
  s.logged.clear();
  s.say(1, Decline{{1}, "type_unknown", "the type p/msg/T is not known here"});
  s.lose(1, 4002);
  s.did();
  EXPECT_EQ(s.logged,
            "/peer at 10.0.0.1 does not import /a, and says: the type p/msg/T is not known here "
            "(type_unknown)\n"
            "lost the link with /peer at 10.0.0.1: it says: lost\n");
}

// What the log says, and at which level, when the link of an open peer ends in this way.
std::pair<LogLevel, std::string> line_of(const ConnectionClosed& closed) {
  Script s(server());
  s.join(1);
  s.did();
  s.give(closed);
  std::vector<std::pair<LogLevel, std::string>> lines;
  while (const auto action = s.side.next_action())
    if (const auto* log = std::get_if<Log>(&*action)) lines.emplace_back(log->level, log->text);
  EXPECT_EQ(lines.size(), 1U);
  return lines.at(0);
}

TEST(Lines, APeerThatStopsIsNoTrouble) {
  const auto [level, text] = line_of({{1}, 1001, "the peer is stopping"});
  EXPECT_EQ(level, LogLevel::kInfo);
  EXPECT_EQ(text, "the link with /peer at 10.0.0.1 was closed: the peer is stopping");
}

TEST(Lines, AProxyThatStopsIsTrouble) {
  const auto [level, text] = line_of({{1}, 1001, "closed by the other end"});
  EXPECT_EQ(level, LogLevel::kWarn);
  EXPECT_EQ(text, "lost the link with /peer at 10.0.0.1: it says: closed by the other end");
}

TEST(Lines, ALinkThatIsLostIsTrouble) {
  const auto [level, text] = line_of({{1}, std::nullopt, "lost"});
  EXPECT_EQ(level, LogLevel::kWarn);
  EXPECT_EQ(text, "lost the link with /peer at 10.0.0.1: lost");
}

// ---- of an identity that comes again and again

TEST(Lines, OfRenewalsAreFewHoweverOftenAnIdentityComes) {
  Script s(server());
  s.give(TimePassed{});
  s.did();
  s.logged.clear();
  const auto renew = [&](std::uint32_t n, const Identity& who, bool right) {
    s.say(n, Renew{"token", "a"});
    s.give(Authenticated{{n}, right ? std::optional(who) : std::nullopt, "unknown token"});
  };
  for (std::uint32_t n = 1; n <= 5; ++n) {
    s.login(n, {}, called("busy"));
    for (int i = 0; i < 16; ++i) renew(n, called("busy"), i % 2 == 0);
  }
  s.did();
  EXPECT_EQ(times(s.logged, "\n"), 30) << s.logged;
  EXPECT_GT(times(s.logged, "has renewed its login as busy"), 0);
  EXPECT_GT(times(s.logged, "is refused: unknown token"), 0);
  s.login(6, {}, called("calm"));
  renew(6, called("calm"), true);
  s.did();
  EXPECT_EQ(times(s.logged, "has renewed its login as calm"), 1);
}

TEST(Lines, OfCallsThatAreRefusedHereAreFewHoweverOftenAnIdentityComes) {
  auto options = server({callable()});
  options.call_bytes_max = 20;
  Script s(options);
  s.graph({}, {service("/s")});
  const auto call = [&](std::uint32_t n, std::uint32_t id) {
    s.message(n, 1, id, "more bytes than may wait");
    s.did();
  };
  const auto come_and_call = [&](std::uint32_t n, const std::string& who) {
    s.login(n, {}, called(who));
    s.say(n, Accepts{{{{}, {}, {"/**"}}}, {}});
    s.say(n, Attach{{1}, {1}});
    s.give(ServiceReady{{1}, true, "hash"});
    call(n, 1);
  };
  for (std::uint32_t n = 1; n <= 3; ++n) come_and_call(n, "busy");
  EXPECT_EQ(times(s.logged, "call(s) of busy"), 1) << s.logged;
  come_and_call(4, "calm");
  EXPECT_EQ(times(s.logged, "1 call(s) of calm"), 1) << s.logged;
  s.pass(10'000);
  call(1, 2);
  EXPECT_EQ(times(s.logged, "3 call(s) of busy"), 1) << s.logged;
}

TEST(Lines, OfCallsThatAnIdentityRefusesAreFewHoweverOftenItComes) {
  Script s(server({callable()}));
  s.graph({});
  s.pass(1500);
  const auto come_and_refuse = [&](std::uint32_t n, const std::string& who) {
    s.login(n, {}, called(who));
    s.say(n, Accepts{});
    s.say(n, Offer{{service_channel(1, "/s" + std::to_string(n))}, true});
    s.say(n, Attached{{1}, {1}, {0}, {}, "hash"});
    s.give(RequestTaken{{n}, {n}, sample("q")});
    s.say(n, Refuse{{1}, {{1}}, "limit", "too many"});
    s.did();
  };
  for (std::uint32_t n = 1; n <= 3; ++n) come_and_refuse(n, "busy");
  EXPECT_EQ(times(s.logged, "refused by"), 1) << s.logged;
  come_and_refuse(4, "calm");
  EXPECT_EQ(times(s.logged, "refused by"), 2) << s.logged;
}

TEST(Lines, AClientThatCannotConnectSaysSoNowAndThen) {
  Script s(client());
  s.give(TimePassed{});
  std::uint32_t dial = 0;
  while (s.at < 21 * 60'000) {
    if (s.did().find("dial ") != std::string::npos)
      s.give(DialFailed{{++dial}, {Cause::kPortClosed, "refused"}});
    s.pass(1000);
  }
  EXPECT_EQ(s.logged,
            "cannot connect: refused; trying again\n"
            "still cannot connect, for 1 min: refused; trying again\n"
            "still cannot connect, for 11 min: refused; trying again\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
