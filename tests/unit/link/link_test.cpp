// Whose channel a number is, and what a peer may do with it.
#include "core/link/link.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "unit/link/quiet_user.hpp"
#include "unit/link/script.hpp"

namespace connect_bridge::link_test {
namespace {

struct Nobody final : QuietUser {};

std::string taken(std::string& words) {
  return std::exchange(words, "");
}

// A channel on which the peer sends.
struct Receives final : IncomingChannel {
  explicit Receives(Link& of) : link(of) {}

  Result<Nothing> on_message(InMessage message, const Now&) override {
    words += "message " + std::to_string(message.sequence);
    return Nothing{};
  }
  void on_withdraw(const Withdraw& why, const Now&) override {
    words += link.expects(why.channels.front()) ? "withdrawn too early" : "withdrawn";
  }
  void on_wheel_wanted(WheelWant want, const Now&) override {
    words += want == WheelWant::kTake ? "take" : "leave";
  }
  Result<Nothing> on_origins(const OriginsChanged& change, const Now&) override {
    words += "origins of " + std::to_string(change.channel.value);
    return Nothing{};
  }

  Link& link;
  std::string words;
};

// A channel on which this side sends.
struct Sends final : OutgoingChannel {
  void on_demand(const ChannelDemand& demand, const Now&) override {
    words += "demand " + std::to_string(demand.number);
    if (demand.after) words += " after " + std::to_string(*demand.after);
  }
  void on_decline(const Decline&, const Now&) override { words += "declined"; }
  void on_wheel(WheelState state, const Now&) override {
    words += state == WheelState::kHalted ? "halted" : "another state";
  }
  Result<Nothing> on_attach(const Attach& attach, const Now&) override {
    words += "attach " + std::to_string(attach.requests.value);
    return Nothing{};
  }
  Result<Nothing> on_forget(const Forget&, const Now&) override {
    words += "forget";
    return Nothing{};
  }

  std::string words;
};

AccountOptions one_channel_a_second() {
  AccountOptions options;
  options.ends_per_second = 1;
  return options;
}

// A link whose connection, which is not needed for this, stays away.
struct Numbered {
  // Empty, or why the connection ends.
  std::string hear(Control message, std::int64_t at = 0) {
    const auto result = link.on_control(message, now_ms(at));
    return result ? "" : std::string(name_of(result.error().code));
  }
  std::string withdraw(std::uint32_t number, std::int64_t at = 0) {
    return hear(Withdraw{{ChannelId{number}}}, at);
  }
  void message_on(std::uint32_t number, std::uint32_t sequence) {
    InMessage message;
    message.channel = {number};
    message.sequence = sequence;
    EXPECT_TRUE(link.incoming({number})->channel->on_message(std::move(message), now_ms(0)));
  }
  void offered(Receives& ear, std::uint32_t number) {
    link.expect_offered({number}, InterfaceKind::kTopic);
    link.take_offered({number}, ear);
  }

  Nobody user;
  Shares all{one_channel_a_second()};
  std::shared_ptr<Account> account = std::make_shared<Account>(one_channel_a_second(), &all);
  Link link{{1}, user, account};
  Sends mouth;
};

constexpr char kUnknown[] = "unknown_channel";

TEST(Link, WhatArrivesReachesTheOwnerOfItsNumber) {
  Numbered s;
  Receives a(s.link);
  Receives b(s.link);
  s.offered(a, 5);
  s.offered(b, 6);
  s.message_on(6, 1);
  EXPECT_EQ(s.hear(OriginsChanged{{5}, {}, {}}), "");
  EXPECT_EQ(taken(a.words), "origins of 5");
  EXPECT_EQ(taken(b.words), "message 1");
  EXPECT_EQ(s.link.offered(), 2U);
  EXPECT_EQ(s.withdraw(5), "");
  EXPECT_EQ(a.words + b.words, "withdrawn");
  EXPECT_EQ(s.link.offered(), 1U);
}

// It was declined, or has ended here: the peer learns that only when it has sent some more.
TEST(Link, WhatComesWithoutAnOwnerIsDroppedUntilItIsWithdrawn) {
  Numbered s;
  Receives ear(s.link);
  s.link.expect_offered({5}, InterfaceKind::kTopic);
  s.offered(ear, 6);
  s.link.let_go({6});
  for (const std::uint32_t number : {5U, 6U}) {
    EXPECT_TRUE(s.link.expects({number}));
    EXPECT_FALSE(s.link.incoming({number})->channel);
    EXPECT_EQ(s.hear(OriginsChanged{{number}, {}, {}}), "");
    EXPECT_EQ(s.withdraw(number), "");
    EXPECT_FALSE(s.link.expects({number}));
    EXPECT_EQ(s.withdraw(number), kUnknown);
  }
  EXPECT_EQ(ear.words, "");
  EXPECT_EQ(s.link.offered(), 0U);
}

TEST(Link, NumbersThatWereNeverGivenEndTheConnection) {
  Numbered s;
  EXPECT_EQ(s.hear(OriginsChanged{{9}, {}, {}}), kUnknown);
  EXPECT_EQ(s.withdraw(9), kUnknown);
  EXPECT_EQ(s.hear(Attached{{9}, {1}, {}}), kUnknown);
  EXPECT_EQ(s.hear(Refuse{{9}, {}, "limit", ""}), kUnknown);
  EXPECT_EQ(s.hear(Attach{{9}, {1}}), kUnknown);
  EXPECT_EQ(s.hear(Forget{{9}, {}}), kUnknown);
  EXPECT_FALSE(s.link.expects({1}));
}

// Also where nobody has taken it: what is legal does not depend on our rules.
TEST(Link, OnlyATopicHasOrigins) {
  Numbered s;
  Receives requests(s.link);
  s.link.expect_offered({5}, InterfaceKind::kService);
  s.link.expect({6}, requests);
  EXPECT_EQ(s.hear(OriginsChanged{{5}, {}, {}}), kUnknown);
  EXPECT_EQ(s.hear(OriginsChanged{{6}, {}, {}}), kUnknown);
  EXPECT_EQ(requests.words, "");
}

TEST(Link, WhatCrossesOurWithdrawIsNoErrorOfThePeer) {
  Numbered s;
  const ChannelId number = s.link.open_channel(s.mouth);
  s.link.withdraw(number);
  EXPECT_EQ(s.hear(Demand{{{number, 1}}}), "");
  EXPECT_EQ(s.hear(Decline{number, "qos", "why"}), "");
  EXPECT_EQ(s.hear(Forget{number, {}}), "");
  EXPECT_EQ(s.hear(Attach{number, {8}}), "");
  EXPECT_TRUE(s.link.expects({8}));  // requests may follow at once
  EXPECT_FALSE(s.link.incoming({8})->channel);
  EXPECT_EQ(s.withdraw(8), "");
  EXPECT_EQ(s.mouth.words, "");
}

TEST(Link, ANumberOfRequestsIsFreeWhenThePeerHasWithdrawnIt) {
  Numbered s;
  Receives requests(s.link);
  const ChannelId service = s.link.open_channel(s.mouth);
  s.link.expect({8}, requests);
  EXPECT_EQ(s.hear(Attach{service, {8}}), "illegal");
  s.link.let_go({8});
  EXPECT_EQ(s.hear(Attach{service, {8}}), "illegal");
  EXPECT_EQ(s.mouth.words, "");
  EXPECT_EQ(s.withdraw(8), "");
  EXPECT_EQ(s.hear(Attach{service, {8}}), "");
  EXPECT_EQ(s.mouth.words, "attach 8");
}

// Each is remembered until the peer confirms its end.
TEST(Link, EndedChannelsOfRequestsAreLimited) {
  Numbered s;
  Receives requests(s.link);
  const ChannelId service = s.link.open_channel(s.mouth);
  s.link.withdraw(service);
  std::uint32_t last = 0;
  for (int i = 0; i < 5000; ++i) {  // those that were confirmed do not count
    EXPECT_EQ(s.hear(Attach{service, {++last}}), "");
    EXPECT_EQ(s.withdraw(last), "");
  }
  for (int i = 0; i < 4096; ++i) {
    s.link.expect({++last}, requests);
    s.link.let_go({last});
    s.link.let_go({last});  // once
  }
  EXPECT_EQ(s.withdraw(last), "");
  EXPECT_EQ(s.hear(Attach{service, {++last}}), "");
  EXPECT_EQ(s.hear(Attach{service, {++last}}), "too_large");
}

// So much may come at once; channels of requests cost nothing here.
TEST(Link, OffersThatComeAndGoAndDemandsThatEndAreLimited) {
  Numbered s;
  Receives requests(s.link);
  const ChannelId topic = s.link.open_channel(s.mouth);
  for (std::uint32_t i = 1; i <= 100; ++i) {
    s.link.expect({i}, requests);
    EXPECT_EQ(s.withdraw(i), "");
    EXPECT_EQ(s.hear(Demand{{{topic, 1}}}), "");
  }
  for (int i = 0; i < Account::kBurst; ++i) {
    s.link.expect_offered({5}, InterfaceKind::kTopic);
    EXPECT_EQ(s.withdraw(5), "");
    EXPECT_EQ(s.hear(Demand{{{topic, 0}}}), "");
  }
  s.link.expect_offered({5}, InterfaceKind::kTopic);
  EXPECT_EQ(s.withdraw(5), "too_large");
  EXPECT_EQ(s.hear(Demand{{{topic, 0}}}), "too_large");
  EXPECT_EQ(s.hear(Demand{{{topic, 0}}}, 1000), "");
}

TEST(Link, ALostConnectionTakesItsChannelsButNeitherNumbersNorWhatWasAdmitted) {
  Numbered s;
  Receives ear(s.link);
  Treatment slow;
  slow.max_rate = 1;
  const ChannelId number = s.link.open_channel(s.mouth);
  s.offered(ear, 5);
  const auto passes = [&](const char* name, std::int64_t ms) {
    return s.link.rate_of({name, "p/msg/T"}, Gid{}, slow, now_ms(ms))
        ->admit(100, 0, now_ms(ms).steady);
  };
  EXPECT_TRUE(passes("/a", 0));
  s.link.drop_connection();
  EXPECT_FALSE(s.link.expects({5}));
  EXPECT_EQ(s.link.offered(), 0U);
  EXPECT_FALSE(s.link.outgoing(number));
  EXPECT_NE(s.link.open_channel(s.mouth), number);
  EXPECT_FALSE(passes("/a", 1));
  EXPECT_TRUE(passes("/b", 1));
}

// A search costs as much as the table has publishers.
TEST(Link, AFullTableOfRatesIsSearchedForAnotherPublisherAndOnceASecond) {
  Numbered s;
  Treatment slow;
  slow.max_rate = 1;
  std::uint32_t last = 0;
  const auto ask = [&](std::uint32_t n, std::int64_t ms) {
    Gid publisher;
    for (int i = 0; i < 4; ++i) publisher.bytes[i] = static_cast<std::uint8_t>(n >> (8U * i));
    static_cast<void>(s.link.rate_of({"/a", "p/msg/T"}, publisher, slow, now_ms(ms)));
    return s.link.memory.used();
  };
  const auto fill = [&](std::int64_t ms) {
    std::uint64_t bytes = 0;
    for (int i = 0; i < 4096; ++i) bytes = ask(++last, ms);
    return bytes;
  };
  const std::uint64_t full = fill(0);
  EXPECT_EQ(ask(last, 5000), full);
  const std::uint64_t one = ask(++last, 5000);
  EXPECT_LT(one, full / 1000);
  EXPECT_EQ(fill(5000), full + one);  // the last one shares
  EXPECT_EQ(ask(++last, 5999), full + one);
  EXPECT_EQ(ask(++last, 6000), one);
}

// A peer may offer others on each connection.
TEST(Link, WhatIsRememberedOfATopicTakesMemoryOfTheLink) {
  Numbered s;
  const auto keep = [&](const std::string& name) {
    TopicStatus seen;
    seen.topic = name;
    seen.messages = 1;
    const std::uint64_t before = s.link.memory.used();
    s.link.keep_counts({seen});
    return s.link.memory.used() - before;
  };
  const auto limit = [&](const std::string& name) {
    Treatment slow;
    slow.max_rate = 1;
    const std::uint64_t before = s.link.memory.used();
    static_cast<void>(s.link.rate_of({name, "p/msg/T"}, Gid{}, slow, now_ms(0)));
    return s.link.memory.used() - before;
  };
  const std::string name(200, 'a');
  for (const auto& take : {std::function(keep), std::function(limit)}) {
    EXPECT_GT(take(name), name.size() + sizeof(RateLimit));
    EXPECT_EQ(take(name), 0U);
  }
  const auto all = s.link.memory.hold(s.link.memory.room());
  EXPECT_EQ(keep("/other"), 0U);
  TopicStatus other;
  other.topic = "/other";
  s.link.add_past(other);
  EXPECT_EQ(other.messages, 0U);
}

TEST(Link, EachChannelOfADemandHasItsOwnFlags) {
  Numbered s;
  Sends other;
  const ChannelId one = s.link.open_channel(s.mouth);
  const ChannelId two = s.link.open_channel(other);
  EXPECT_EQ(s.hear(Demand{{{one, 4, true, 7}, {{99}, 4, true, 8}, {two, 0}}}), "");
  EXPECT_EQ(s.mouth.words, "demand 4 after 7");
  EXPECT_EQ(other.words, "demand 0");
}

// The channel is the operator's in both directions: the robot imports the topic.
TEST(Link, TheWheelOfATopicIsItsChannelsAffair) {
  Numbered s;
  Receives robots(s.link);
  const ChannelId steered = s.link.open_channel(s.mouth);
  s.link.expect_offered({5}, InterfaceKind::kTopic);
  EXPECT_EQ(s.hear(Wheel{{5}, {}, WheelWant::kTake}), "");  // declined here
  s.link.take_offered({5}, robots);
  EXPECT_EQ(s.hear(Wheel{steered, WheelState::kHalted}), "");
  EXPECT_EQ(s.hear(Wheel{{5}, {}, WheelWant::kTake}), "");
  EXPECT_EQ(s.hear(Wheel{{5}, {}, WheelWant::kLeave}), "");
  EXPECT_EQ(s.mouth.words, "halted");
  EXPECT_EQ(robots.words, "takeleave");
  // A state may cross our withdraw; a wish comes only for a topic that the peer offers.
  EXPECT_EQ(s.hear(Wheel{{99}, WheelState::kFree}), "");
  s.link.expect_offered({6}, InterfaceKind::kService);
  EXPECT_EQ(s.hear(Wheel{{6}, {}, WheelWant::kTake}), kUnknown);
  EXPECT_EQ(s.hear(Wheel{{7}, {}, WheelWant::kTake}), kUnknown);
}

}  // namespace
}  // namespace connect_bridge::link_test
