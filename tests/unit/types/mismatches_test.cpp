// When the log says how a type differs, and when that it is not known.
#include "core/types/mismatches.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <variant>

#include "core/types/type_description.hpp"
#include "unit/flow/script.hpp"
#include "unit/types/descriptions.hpp"

namespace connect_bridge {
namespace {

using flow_test::now_ms;
using testing::HasSubstr;
using testing::Not;

const std::string kTextThere =
    canonical_text(description("p/msg/T", {field("x", FieldKind::kInt8)}));
const std::string kTextHere =
    canonical_text(description("p/msg/T", {field("y", FieldKind::kInt8)}));
const Definition kThere{"p/msg/T", "RIHS01_there"};

struct Told {
  bool begin(const std::string& hash = kThere.second, std::int64_t at = 0) {
    return begin_of(account, hash, at);
  }
  bool begin_of(const std::shared_ptr<Account>& of, const std::string& hash, std::int64_t at = 0,
                bool used = false) {
    return subject.begin({{"p/msg/T", hash}, "RIHS01_here", "cannot mirror /a", "peer", used, of},
                         now_ms(at));
  }
  void look_up(std::uint64_t lookup, const std::string& text = kTextHere) {
    subject.on_looked_up({{lookup}, text});
  }
  // The lines of the log, and "look up 1" of what is asked for here.
  std::string did() {
    std::string lines;
    while (const auto action = outputs.next()) {
      if (const auto* log = std::get_if<Log>(&*action)) lines += log->text + "\n";
      if (const auto* look = std::get_if<LookUpType>(&*action))
        lines += "look up " + std::to_string(look->id.value) + " " + look->hash + "\n";
    }
    return lines;
  }
  [[nodiscard]] std::int64_t deadline() const {
    const auto at = subject.deadline();
    return at ? (*at - TimePoint{}) / std::chrono::milliseconds(1) : -1;
  }

  Outputs outputs;
  std::shared_ptr<Account> account = std::make_shared<Account>();
  Mismatches subject{outputs};
};

constexpr char kNotTold[] = "does not tell its definition";

TEST(Mismatches, ALineIsWrittenWhenBothDefinitionsAreKnown) {
  for (const bool here_first : {true, false}) {
    Told s;
    EXPECT_TRUE(s.begin());
    EXPECT_EQ(s.did(), "look up 1 RIHS01_here\n");
    EXPECT_TRUE(s.subject.waits_for(kThere));
    if (here_first) s.look_up(1);
    if (!here_first) s.subject.on_there(kThere, kTextThere);
    EXPECT_EQ(s.did(), "");
    EXPECT_EQ(s.subject.waits_for(kThere), here_first);
    if (here_first) s.subject.on_there(kThere, kTextThere);
    if (!here_first) s.look_up(1);
    EXPECT_THAT(s.did(), HasSubstr("'x'"));
    EXPECT_EQ(s.deadline(), -1);
    s.look_up(1);
    s.subject.on_there(kThere, kTextThere);
    EXPECT_EQ(s.did(), "");  // once
  }
}

TEST(Mismatches, WhatIsOfAnotherDefinitionOrLookupIsNotTaken) {
  Told s;
  EXPECT_TRUE(s.begin());
  s.did();
  s.look_up(2);
  s.subject.on_there({"p/msg/T", "RIHS01_other"}, kTextThere);
  s.subject.on_there({"p/msg/U", kThere.second}, kTextThere);
  s.subject.on_gone({"p/msg/T", "RIHS01_other"});
  EXPECT_EQ(s.did(), "");
  EXPECT_TRUE(s.subject.waits_for(kThere));
  s.subject.on_there(kThere, kTextThere);
  EXPECT_EQ(s.did(), "");  // its own definition here is still looked up
  s.look_up(1);
  EXPECT_NE(s.did(), "");
}

TEST(Mismatches, WhoDoesNotTellIsNamed) {
  Told peer;
  EXPECT_TRUE(peer.begin());
  peer.look_up(1);
  peer.subject.on_there(kThere, "");
  EXPECT_THAT(peer.did(), HasSubstr(std::string("the peer ") + kNotTold));
  Told own;
  EXPECT_TRUE(own.begin());
  own.look_up(1, "");
  own.subject.on_there(kThere, kTextThere);
  EXPECT_THAT(own.did(), HasSubstr(std::string("this side ") + kNotTold));
}

// Text of a peer is hostile.
TEST(Mismatches, ATextThatIsNoDescriptionTellsNothing) {
  Told s;
  EXPECT_TRUE(s.begin());
  s.look_up(1);
  s.subject.on_there(kThere, "{\"type_description\": [[[");
  EXPECT_THAT(s.did(), HasSubstr(kNotTold));
}

TEST(Mismatches, NoLineWaitsForLongerThanItsTime) {
  Told s;
  EXPECT_TRUE(s.begin("RIHS01_1", 0));
  EXPECT_TRUE(s.begin("RIHS01_2", 1000));
  s.did();
  EXPECT_EQ(s.deadline(), 5000);
  s.subject.on_time(now_ms(4999));
  EXPECT_EQ(s.did(), "");
  s.subject.on_time(now_ms(5000));
  const std::string lines = s.did();
  EXPECT_THAT(lines, HasSubstr("RIHS01_1"));
  EXPECT_THAT(lines, Not(HasSubstr("RIHS01_2")));
  EXPECT_EQ(s.deadline(), 6000);
}

TEST(Mismatches, WhatNobodyOffersAnyLongerIsToldAsItIs) {
  Told s;
  EXPECT_TRUE(s.begin());
  s.did();
  s.subject.on_gone(kThere);
  EXPECT_THAT(s.did(), HasSubstr(kNotTold));
  EXPECT_FALSE(s.subject.waits_for(kThere));
  EXPECT_EQ(s.deadline(), -1);
}

TEST(Mismatches, AnIdentityIsToldOfADefinitionOnce) {
  Told s;
  EXPECT_TRUE(s.begin());
  EXPECT_FALSE(s.begin());
  s.look_up(1);
  s.subject.on_there(kThere, kTextThere);
  EXPECT_FALSE(s.begin());
  s.did();
  EXPECT_TRUE(s.begin("RIHS01_other"));
  EXPECT_TRUE(s.begin_of(std::make_shared<Account>(), kThere.second));
  EXPECT_TRUE(s.begin_of(s.account, kThere.second, 0, true));  // now the rules use it
}

// One that offers many types must not silence the others.
TEST(Mismatches, OfOneIdentityAndInAllSoManyLinesWait) {
  Told s;
  std::size_t waiting = 0;
  const auto fill = [&](const std::shared_ptr<Account>& of) {
    for (std::size_t i = 0; i < Mismatches::kAccountWaitingMax; ++i, ++waiting)
      EXPECT_TRUE(s.begin_of(of, "RIHS01_" + std::to_string(i)));
    s.did();
    EXPECT_FALSE(s.begin_of(of, "RIHS01_more"));
    EXPECT_THAT(s.did(), HasSubstr("too many such lines wait"));  // at once, and nobody is asked
  };
  while (waiting < Mismatches::kWaitingMax) fill(std::make_shared<Account>());
  const auto late = std::make_shared<Account>();
  EXPECT_FALSE(s.begin_of(late, "RIHS01_0"));
  EXPECT_THAT(s.did(), HasSubstr("too many such lines wait"));
  s.subject.on_time(now_ms(5000));
  EXPECT_TRUE(s.begin_of(late, "RIHS01_1", 5000));
}

TEST(Mismatches, WhatIsUsedAllTheSameIsAWarning) {
  for (const bool used : {false, true}) {
    Told s;
    EXPECT_TRUE(s.begin_of(s.account, kThere.second, 0, used));
    EXPECT_TRUE(s.outputs.next());  // the look-up
    s.subject.on_gone(kThere);
    const auto action = s.outputs.next();
    ASSERT_TRUE(action);
    EXPECT_EQ(std::get<Log>(*action).level, used ? LogLevel::kWarn : LogLevel::kError);
  }
}

}  // namespace
}  // namespace connect_bridge
