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
  EXPECT_EQ(side_options(usual).account.channels_per_second, core.channels_per_second);
  EXPECT_EQ(side_options(usual).account.control_bytes_per_second, core.control_bytes_per_second);
  EXPECT_EQ(side_options(usual).account.services_max, core.services_max);
  EXPECT_EQ(side_options(usual).listeners_max, TopicOptions().listeners_max);
  EXPECT_EQ(usual.socket.receive_packets_per_second, 50'000);
  EXPECT_EQ(usual.socket.receive_bytes_per_second, 0);
  const Config own = config_of(yaml(R"(
url: ws://localhost
memory_max: 16777216
mirrors_per_second: 50
peer_packets_per_second: 7
peer_bytes_per_second: 8
limits:
  channels_per_second: 9
  control_bytes_per_second: 70000
  services_max: 11
  listeners_max: 12
)"),
                               Role::kClient);
  EXPECT_EQ(side_options(own).account.memory_bytes_max, 16U << 20);
  EXPECT_EQ(side_options(own).account.mirror_period, std::chrono::milliseconds(20));
  EXPECT_EQ(side_options(own).account.channels_per_second, 9);
  EXPECT_EQ(side_options(own).account.control_bytes_per_second, 70'000U);
  EXPECT_EQ(side_options(own).account.services_max, 11U);
  EXPECT_EQ(side_options(own).listeners_max, 12U);
  EXPECT_EQ(own.socket.receive_packets_per_second, 7);
  EXPECT_EQ(own.socket.receive_bytes_per_second, 8);
  EXPECT_THAT(own.warnings, Contains(HasSubstr("memory_max: less than 3 times max_message_size")));
}

TEST(Config, LimitsOfStrangersReachTheCoreAndTheListener) {
  const Config usual = config_of({}, Role::kServer);
  const LinkOptions core;
  EXPECT_EQ(usual.limits.strangers_max, core.strangers_max);
  EXPECT_EQ(usual.limits.wrong_logins_at_once, core.wrong_logins_at_once);
  EXPECT_EQ(usual.limits.wrong_login_period, core.wrong_login_period);
  EXPECT_EQ(usual.limits.address_wrong_logins_at_once, core.address_wrong_logins_at_once);
  EXPECT_EQ(usual.limits.address_wrong_login_period, core.address_wrong_login_period);
  EXPECT_EQ(usual.limits.account.offence_period, core.account.offence_period);
  EXPECT_EQ(usual.listen.pending_per_address_max, 16U);
  EXPECT_EQ(usual.listen.handshakes_at_once, 150);
  EXPECT_EQ(usual.listen.handshake_period, std::chrono::milliseconds(20));
  EXPECT_EQ(usual.listen.address_handshakes_at_once, 30);
  EXPECT_EQ(usual.listen.address_handshake_period, std::chrono::milliseconds(100));
  const Config own = config_of(yaml(R"(
limits:
  strangers_max: 9
  address_strangers_max: 2
  handshakes_per_second: 5
  address_handshakes_per_second: 4
  wrong_logins_per_minute: 120
  address_wrong_logins_per_minute: 6
  offences_per_minute: 60
)"),
                               Role::kServer);
  EXPECT_EQ(own.limits.strangers_max, 9U);
  EXPECT_EQ(own.limits.wrong_logins_at_once, 120);
  EXPECT_EQ(own.limits.wrong_login_period, std::chrono::milliseconds(500));
  EXPECT_EQ(own.limits.address_wrong_logins_at_once, 6);
  EXPECT_EQ(own.limits.address_wrong_login_period, std::chrono::seconds(10));
  EXPECT_EQ(own.limits.account.offence_period, std::chrono::seconds(1));
  EXPECT_EQ(own.listen.pending_per_address_max, 2U);
  EXPECT_EQ(own.listen.handshakes_at_once, 15);
  EXPECT_EQ(own.listen.handshake_period, std::chrono::milliseconds(200));
  EXPECT_EQ(own.listen.address_handshakes_at_once, 12);
  EXPECT_EQ(own.listen.address_handshake_period, std::chrono::milliseconds(250));
}

}  // namespace
}  // namespace connect_bridge
