// The shares of peers in a side's resources.
#include <gmock/gmock.h>

#include "config/config.hpp"
#include "yaml_parameters.hpp"

namespace connect_bridge {
namespace {

using testing::Contains;
using testing::HasSubstr;

TEST(Config, SharesReachTheCoreAndTheNetwork) {
  const Config usual = config_of(yaml("url: ws://localhost"), Role::kClient);
  const AccountOptions core;
  EXPECT_EQ(side_options(usual).account.memory_bytes_max, core.memory_bytes_max);
  EXPECT_EQ(side_options(usual).account.mirror_period, core.mirror_period);
  EXPECT_EQ(usual.socket.packets_per_second, 50'000);
  EXPECT_EQ(usual.socket.bytes_per_second, 0);
  const Config own = config_of(yaml(R"(
url: ws://localhost
memory_max: 16777216
mirrors_per_second: 50
peer_packets_per_second: 7
peer_bytes_per_second: 8
)"),
                               Role::kClient);
  EXPECT_EQ(side_options(own).account.memory_bytes_max, 16U << 20);
  EXPECT_EQ(side_options(own).account.mirror_period, std::chrono::milliseconds(20));
  EXPECT_EQ(own.socket.packets_per_second, 7);
  EXPECT_EQ(own.socket.bytes_per_second, 8);
  EXPECT_THAT(own.warnings, Contains(HasSubstr("memory_max: less than 3 times max_message_size")));
}

}  // namespace
}  // namespace connect_bridge
