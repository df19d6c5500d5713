#include "relay/name_desk.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <thread>

#include "unit/net/websocket/harness.hpp"

namespace connect_bridge::test {
namespace {

struct Nobody : Authenticator {
  Judgement judge(const Attempt&, Stamp) override { return {}; }
};

TEST(NameDesk, GivesOneNameAfterTheOtherBesideTheLoop) {
  Loop loop;
  std::atomic<int> at_work{0}, most{0};
  std::atomic<bool> on_the_loop{false};
  const auto hand_over = [&, own = std::this_thread::get_id()](
                             const RobotNames::Taking& of,
                             std::string& problem) -> std::unique_ptr<Authenticator> {
    most = std::max<int>(most, ++at_work);
    if (std::this_thread::get_id() == own) on_the_loop = true;
    --at_work;
    if (of.robot == "broken") throw std::runtime_error("no memory");
    if (of.robot == "full") problem = "the disk is full";
    return problem.empty() ? std::make_unique<Nobody>() : nullptr;
  };
  NameDesk desk(loop.io, hand_over);
  std::vector<std::string> told;
  for (const std::string name : {"robot7", "full", "robot8", "broken", "robot9"})
    desk.give({name, {}, {}}, [&, name](auto robots, const std::string& problem) {
      told.push_back(name + (robots ? " is given" : ": " + problem));
    });
  EXPECT_THAT(told, testing::IsEmpty());
  ASSERT_TRUE(loop.until([&] { return told.size() == 5; }));
  EXPECT_THAT(told,
              testing::ElementsAre("robot7 is given", "full: the disk is full", "robot8 is given",
                                   "broken: no memory", "robot9 is given"));
  EXPECT_EQ(most, 1);
  EXPECT_FALSE(on_the_loop);
}

}  // namespace
}  // namespace connect_bridge::test
