// The places of connections without a login, and the answers that wait there.
#include "core/link/strangers.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "unit/link/script.hpp"

namespace connect_bridge::link_test {
namespace {

// One wrong login in 20 s of an address, and three of all.
LinkOptions few_places() {
  LinkOptions options;
  options.strangers_max = 4;
  options.address_wrong_logins_at_once = 1;
  options.address_wrong_login_period = std::chrono::seconds(20);
  options.wrong_logins_at_once = 3;
  options.wrong_login_period = std::chrono::seconds(20);
  return options;
}

// A server's, whose time for a login is 5 s. Time in milliseconds.
struct Places {
  explicit Places(LinkOptions with = few_places()) : options(std::move(with)) {}

  // From an address of its own, if none is given.
  void connect(std::uint64_t n, std::int64_t at = 0, std::optional<std::string> address = {}) {
    ConnectionOpened opened{{n}, "10.0.0." + std::to_string(n) + ":4"};
    opened.address = address.value_or("10.0.0." + std::to_string(n));
    subject.add(link_test::options(true), opened, now_ms(at));
  }
  void log_in(std::uint64_t n, std::int64_t at = 0, std::optional<std::string> address = {}) {
    connect(n, at, std::move(address));
    Connection& connection = *subject.find({n});
    connection.on_packet(false, Payload::adopt(hello()), now_ms(at));
    connection.on_packet(false, Payload::adopt(login()), now_ms(at));
    EXPECT_TRUE(connection.take_login());
  }
  // Whether the answer of the login method comes late.
  bool is_late(std::uint64_t n, std::optional<Identity> identity, std::int64_t at = 0,
               std::int64_t not_before = 0) {
    Authenticated answer{{n}, std::move(identity), "wrong"};
    return subject.puts_off(answer, now_ms(not_before).steady, now_ms(at));
  }
  // The answers that are due: "1 anna", "1 -".
  std::string due(std::int64_t at) {
    std::string words;
    while (const auto answer = subject.take_due(now_ms(at)))
      words += (words.empty() ? "" : ", ") + std::to_string(answer->connection.value) + " " +
               (answer->identity ? answer->identity->name : "-");
    return words;
  }
  // "close 1 4012 why"; lines of the log, without their ends, as "log".
  std::string did() {
    std::string words;
    while (const auto action = outputs.next()) {
      if (!words.empty()) words += ", ";
      if (const auto* close = std::get_if<CloseConnection>(&*action))
        words += "close " + std::to_string(close->connection.value) + " " +
                 std::to_string(static_cast<int>(close->code)) + " " + close->reason;
      if (std::holds_alternative<Log>(*action)) words += "log";
    }
    return words;
  }
  // In milliseconds; -1: none.
  [[nodiscard]] std::int64_t deadline() const {
    const auto at = subject.deadline();
    return at ? (*at - TimePoint{}) / std::chrono::milliseconds(1) : -1;
  }

  LinkOptions options;
  Outputs outputs;
  Strangers subject{options, outputs};
};

Identity identity_of(const std::string& name, Stamp expires = 0) {
  return {name, {}, expires, "key of " + name};
}

TEST(StrangerPlaces, TheOldestGivesWayWhereAllAreTaken) {
  Places s;
  for (std::uint64_t n = 1; n <= 4; ++n) s.connect(n);
  EXPECT_EQ(s.did(), "");
  s.connect(5);
  EXPECT_EQ(s.did(), "log, close 1 4012 too many connections without login");
  EXPECT_EQ(s.subject.find({1}), nullptr);
  EXPECT_NE(s.subject.find({2}), nullptr);
  const auto status = s.subject.status();
  EXPECT_EQ(status.waiting, 4U);
  EXPECT_EQ(status.gave_way, 1U);
  EXPECT_EQ(status.logins_without_place, 0U);  // it had shown none
}

TEST(StrangerPlaces, WhereHalfAreTakenALoginMustBeShownSoonAndIsThenLookedAtAsLongAsEver) {
  Places s;
  s.connect(1);
  s.connect(2);
  EXPECT_EQ(s.subject.find({2})->deadline(), now_ms(5000).steady);
  s.log_in(3);
  s.connect(4);
  EXPECT_EQ(s.subject.find({3})->deadline(), now_ms(5000).steady);
  EXPECT_EQ(s.deadline(), 1000);
  s.subject.on_time(now_ms(999));
  EXPECT_FALSE(s.subject.failed());
  s.subject.on_time(now_ms(1000));
  EXPECT_EQ(s.subject.failed(), ConnectionId{4});
  s.subject.refuse({4}, *s.subject.find({4})->failure(), now_ms(1000));
  EXPECT_FALSE(s.subject.failed());
  EXPECT_EQ(s.subject.status().login_timeouts, 1U);
}

TEST(StrangerPlaces, WhoCarriesALinkHasNone) {
  Places s;
  s.log_in(1);
  EXPECT_FALSE(s.is_late(1, identity_of("anna")));
  EXPECT_TRUE(s.subject.take({1}));
  EXPECT_FALSE(s.subject.take({1}));
  EXPECT_EQ(s.subject.find({1}), nullptr);
  EXPECT_EQ(s.subject.status().waiting, 0U);
  EXPECT_EQ(s.deadline(), -1);
}

TEST(StrangerPlaces, ThePeerLearnsNoMoreThanItShallAndTheLogLearnsItOnce) {
  Places s;
  s.log_in(1);
  s.log_in(2);
  s.subject.refuse({1}, {CloseCode::kLoginRefused, "login refused: unknown token"}, now_ms(0),
                   "login refused");
  EXPECT_EQ(s.did(), "log, close 1 4003 login refused");
  s.subject.refuse({2}, {CloseCode::kLoginNotJudged, "why"}, now_ms(0));
  EXPECT_EQ(s.did(), "close 2 4016 why");
  EXPECT_EQ(s.subject.status().logins_not_judged, 1U);
}

TEST(StrangerPlaces, AllAreClosedTogether) {
  Places s;
  s.log_in(1);
  s.connect(2);
  EXPECT_TRUE(s.is_late(1, identity_of("anna"), 0, 2000));
  s.subject.close_all(CloseCode::kGoingAway, "ends");
  EXPECT_EQ(s.did(), "close 1 1001 ends, close 2 1001 ends");
  EXPECT_EQ(s.due(10'000), "");
  EXPECT_EQ(s.deadline(), -1);
}

// ---- answers that come late

TEST(StrangerPlaces, ARightLoginIsAnsweredAtOnceWhateverOthersOfItsAddressTry) {
  Places s;
  for (std::uint64_t n = 1; n <= 3; ++n) s.log_in(n, 0, "10.0.0.9");
  EXPECT_FALSE(s.is_late(1, {}));
  EXPECT_TRUE(s.is_late(2, {}));
  EXPECT_FALSE(s.is_late(3, identity_of("anna")));
  EXPECT_EQ(s.subject.status().wrong_logins, 2U);
  EXPECT_EQ(s.subject.status().wrong_logins_late, 1U);
}

TEST(StrangerPlaces, OneWrongLoginTooManyIsAnsweredThreeSecondsLater) {
  Places s;
  s.log_in(1, 0, "10.0.0.9");
  s.log_in(2, 0, "10.0.0.9");
  EXPECT_FALSE(s.is_late(1, {}, 100));
  EXPECT_TRUE(s.is_late(2, {}, 100));
  s.subject.take({1});
  EXPECT_EQ(s.deadline(), 3100);
  EXPECT_EQ(s.due(3099), "");
  EXPECT_EQ(s.due(3100), "2 -");
  EXPECT_EQ(s.due(3100), "");  // once
}

// The client would never learn why.
TEST(StrangerPlaces, NoAnswerIsLaterThanTheTimeForTheLogin) {
  Places s;
  s.log_in(1, 0, "10.0.0.9");
  s.log_in(2, 0, "10.0.0.9");
  s.log_in(3);
  EXPECT_FALSE(s.is_late(1, {}, 4000));
  EXPECT_TRUE(s.is_late(2, {}, 4000));
  EXPECT_TRUE(s.is_late(3, identity_of("anna"), 4000, 60'000));
  EXPECT_EQ(s.due(4999), "");
  EXPECT_EQ(s.due(5000), "2 -, 3 anna");
}

TEST(StrangerPlaces, WrongLoginsOfAllCountTogether) {
  Places s;
  for (std::uint64_t n = 1; n <= 4; ++n) {
    s.log_in(n, 0, n == 1 ? "" : "10.0.0." + std::to_string(n));  // the first: of no address
    EXPECT_EQ(s.is_late(n, {}), n == 4) << n;
  }
}

TEST(StrangerPlaces, WithoutAnAddressOnlyThoseOfAllAreCounted) {
  Places s;
  for (std::uint64_t n = 1; n <= 3; ++n) {
    s.log_in(n, 0, "");
    EXPECT_FALSE(s.is_late(n, {})) << n;
  }
}

TEST(StrangerPlaces, ALoginThatHasExpiredIsAWrongOne) {
  Places s;
  s.log_in(1, 0, "10.0.0.9");
  s.log_in(2, 0, "10.0.0.9");
  EXPECT_FALSE(s.is_late(1, identity_of("anna", flow_test::at_ms(1000)), 1000));
  EXPECT_TRUE(s.is_late(2, identity_of("anna", flow_test::at_ms(1000)), 1000));
  EXPECT_EQ(s.due(4000), "2 -");
  EXPECT_EQ(s.subject.status().wrong_logins, 2U);
}

TEST(StrangerPlaces, ARightLoginWaitsUntilItsIdentityMayComeBack) {
  Places s;
  s.log_in(1);
  EXPECT_TRUE(s.is_late(1, identity_of("anna"), 0, 2000));
  EXPECT_EQ(s.subject.status().shut_out, 1U);
  EXPECT_EQ(s.deadline(), 2000);
  EXPECT_EQ(s.due(1999), "");
  EXPECT_EQ(s.due(2000), "1 anna");
}

TEST(StrangerPlaces, AnAnswerThatWaitsGoesWithItsConnection) {
  Places s;
  s.log_in(1);
  EXPECT_TRUE(s.is_late(1, identity_of("anna"), 0, 2000));
  s.subject.take({1});
  EXPECT_EQ(s.due(2000), "");
  EXPECT_EQ(s.deadline(), -1);
}

TEST(StrangerPlaces, ALoginThatIsWithdrawnWhileItWaitsLetsNobodyIn) {
  Places s;
  for (std::uint64_t n = 1; n <= 3; ++n) s.log_in(n);
  Identity fixed = identity_of("carl");
  fixed.credential.clear();
  EXPECT_TRUE(s.is_late(1, identity_of("anna"), 0, 2000));
  EXPECT_TRUE(s.is_late(2, identity_of("bert"), 0, 2000));
  EXPECT_TRUE(s.is_late(3, fixed, 0, 2000));
  Identity renamed = identity_of("bert");
  renamed.name = "berta";
  s.subject.take_changes({{{"key of anna", {}}, {"key of bert", renamed}, {"", {}}}});
  EXPECT_EQ(s.due(2000), "1 -, 2 berta, 3 carl");
}

}  // namespace
}  // namespace connect_bridge::link_test
