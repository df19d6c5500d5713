#include "net/relay/client_word.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

TEST(ClientWord, IsThatOfTheProtocol) {
  EXPECT_EQ(client_word(std::string(43, 'A') + "=", "robot7"),
            "fc0886a2f7bdcac6f00e34cac84a6559ce9456b49ee114a3394fca9988c043d4");
  EXPECT_EQ(client_word("", "robot7"), "");
}

}  // namespace
}  // namespace connect_bridge
