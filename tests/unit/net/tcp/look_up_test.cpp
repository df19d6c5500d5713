// Names while no name server answers: the resolver here does so when it is let.
#include "net/tcp/look_up.hpp"

#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <optional>
#include <vector>

#include "unit/net/websocket/harness.hpp"

namespace connect_bridge::test {
namespace {

const asio::ip::tcp::endpoint kRobot(asio::ip::make_address("192.0.2.7"), 443);

// Each test has a name of its own: what comes late would be for the next one of the same name.
// Blocks until answer() is called; what it answers then, or that nothing is known of the name.
class SlowServer {
 public:
  LookUp::Resolve resolver() {
    return [answered = answered_](const std::string& host, std::uint16_t port, ErrorCode& error) {
      answered.wait();
      if (!host.starts_with("robot") || port != 443) error = asio::error::host_not_found;
      return error ? LookUp::Endpoints{} : LookUp::Endpoints{kRobot};
    };
  }
  void answer() { answer_.set_value(); }

 private:
  std::promise<void> answer_;
  const std::shared_future<void> answered_ = answer_.get_future().share();
};

LookUp::Endpoints fails(const std::string&, std::uint16_t, ErrorCode& error) {
  error = asio::error::host_not_found;
  return {};
}

struct Answer {
  ErrorCode error;
  LookUp::Endpoints found;
};

LookUp::Done into(std::optional<Answer>& answer) {
  return [&answer](const ErrorCode& error, const LookUp::Endpoints& found) {
    answer = Answer{error, found};
  };
}

TEST(LookUpTest, Finds) {
  Loop loop;
  SlowServer names;
  names.answer();
  LookUp one(loop.io, names.resolver()), other(loop.io, names.resolver());
  std::optional<Answer> robot, nobody;
  one.start("robot-0", 443, into(robot));
  other.start("nobody", 443, into(nobody));
  EXPECT_FALSE(robot);  // not from inside
  loop.until([&] { return robot && nobody; });
  EXPECT_EQ(robot->found, LookUp::Endpoints{kRobot});
  EXPECT_EQ(nobody->error, asio::error::host_not_found);
}

TEST(LookUpTest, ThatOfTheSystemFindsThisMachine) {
  ErrorCode error;
  const auto found = LookUp::resolve("localhost", 443, error);
  ASSERT_FALSE(error) << error.message();
  ASSERT_FALSE(found.empty());
  EXPECT_TRUE(found.front().address().is_loopback());
  EXPECT_EQ(found.front().port(), 443);
}

// Else a program without a name server could not stop for half a minute.
TEST(LookUpTest, NobodyWaitsForOneThatHangs) {
  SlowServer names;
  std::optional<Answer> first, second;
  {
    Loop loop;
    LookUp hangs(loop.io, names.resolver());
    hangs.start("robot-2", 443, into(first));
    SlowServer others;
    others.answer();
    LookUp next(loop.io, others.resolver());
    next.start("robot-2-next", 443, into(second));
    loop.until([&] { return second.has_value(); });
    EXPECT_FALSE(first);
  }
  names.answer();  // whom it would tell is gone
}

TEST(LookUpTest, AfterStopNobodyIsTold) {
  Loop loop;
  SlowServer names;
  std::optional<Answer> stopped, other;
  LookUp one(loop.io, names.resolver()), two(loop.io, names.resolver());
  one.start("robot-3", 443, into(stopped));
  two.start("robot-3", 443, into(other));
  one.stop();
  names.answer();
  loop.until([&] { return other.has_value(); });
  EXPECT_FALSE(stopped);
}

// Where the first name server is dead each answer takes longer than a dial may.
TEST(LookUpTest, WhatComesWhileTheNextOneWaitsIsForThat) {
  Loop loop;
  SlowServer names, dead;
  std::optional<Answer> first, second;
  LookUp one(loop.io, names.resolver()), two(loop.io, dead.resolver());
  one.start("robot4", 443, into(first));
  one.stop();
  two.start("robot4", 443, into(second));
  names.answer();
  loop.until([&] { return second.has_value(); });
  EXPECT_EQ(second->found, LookUp::Endpoints{kRobot});
  EXPECT_FALSE(first);
  dead.answer();
}

TEST(LookUpTest, WhatComesBetweenTwoIsForTheSecond) {
  Loop loop;
  SlowServer names;
  std::optional<Answer> first, second;
  LookUp one(loop.io, names.resolver());
  one.start("robot5", 443, into(first));
  one.stop();
  names.answer();
  loop.run_for(50ms);  // its thread may need a moment, or more: then once more
  const auto is_found = [&] {
    LookUp two(loop.io, fails);
    second.reset();
    two.start("robot5", 443, into(second));
    return loop.until([&] { return second.has_value(); }) && !second->error;
  };
  ASSERT_TRUE(loop.until(is_found));
  EXPECT_EQ(second->found, LookUp::Endpoints{kRobot});
  EXPECT_FALSE(is_found());  // only for one
}

TEST(LookUpTest, OneThatFailsDoesNotEndAnother) {
  Loop loop;
  SlowServer names;
  std::optional<Answer> first, second;
  LookUp one(loop.io, fails), two(loop.io, names.resolver());
  two.start("robot6", 443, into(second));
  one.start("robot6", 443, into(first));
  loop.until([&] { return first.has_value(); });
  loop.run_for(20ms);
  EXPECT_FALSE(second);
  names.answer();
  loop.until([&] { return second.has_value(); });
  EXPECT_EQ(second->found, LookUp::Endpoints{kRobot});
}

TEST(LookUpTest, ManyThatHangAreNotFollowedByMore) {
  SlowServer names;
  Loop loop;
  std::vector<std::unique_ptr<LookUp>> all;
  std::vector<std::optional<Answer>> answers(LookUp::kUnderWayMax + 1);
  for (auto& answer : answers) {
    all.push_back(std::make_unique<LookUp>(loop.io, names.resolver()));
    all.back()->start("robot-6", 443, into(answer));
  }
  loop.until([&] { return answers.back().has_value(); });
  EXPECT_EQ(answers.back()->error, asio::error::host_not_found_try_again);
  EXPECT_FALSE(answers.front());
  names.answer();
  loop.until([&] { return answers.front().has_value(); });
  EXPECT_FALSE(answers.front()->error);
}

}  // namespace
}  // namespace connect_bridge::test
