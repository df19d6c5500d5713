// Sockets that systemd passes.
#include "run/activation.hpp"

#include <gtest/gtest.h>

namespace connect_bridge::test {
namespace {

using Sockets = std::vector<int>;

TEST(Activation, TakesTheSocketsOfThisProcessOnly) {
  EXPECT_EQ(passed_sockets(77, "77", "1").sockets, Sockets{3});
  EXPECT_EQ(passed_sockets(77, "77", "3").sockets, (Sockets{3, 4, 5}));
  EXPECT_EQ(passed_sockets(77, "77", "3").problem, "");
  for (const char* other : {"", "78", "77x", " 77", "-77"}) {
    const PassedSockets passed = passed_sockets(77, other, "1");
    EXPECT_TRUE(passed.sockets.empty()) << other;
    EXPECT_NE(passed.problem.find("LISTEN_PID"), std::string::npos) << passed.problem;
  }
  for (const char* count : {"", "0", "-1", "9", "many", "99999999999999999999"}) {
    const PassedSockets passed = passed_sockets(77, "77", count);
    EXPECT_TRUE(passed.sockets.empty()) << count;
    EXPECT_NE(passed.problem.find("LISTEN_FDS"), std::string::npos) << passed.problem;
  }
}

}  // namespace
}  // namespace connect_bridge::test
