// The shares of peers in a side's resources.
#include <gmock/gmock.h>

#include "config/config.hpp"
#include "yaml_parameters.hpp"

namespace connect_bridge {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

TEST(Config, SharesReachTheCore) {
  const Config usual = config_of({}, Role::kServer);
  const AccountOptions core;
  EXPECT_EQ(side_options(usual).account.memory_bytes_max, core.memory_bytes_max);
  EXPECT_EQ(side_options(usual).account.offence_period, core.offence_period);
  const Config own = config_of(yaml(R"(
memory_max: 16777216
limits: {offences_per_minute: 60}
)"),
                               Role::kServer);
  EXPECT_EQ(side_options(own).account.memory_bytes_max, 16U << 20);
  EXPECT_EQ(side_options(own).account.offence_period, std::chrono::seconds(1));
  EXPECT_THAT(own.warnings, Contains(HasSubstr("memory_max: less than 3 times max_message_size")));
}

// N11: nodes of a small robot need its memory.
TEST(Config, MemoryFollowsTheMachineUnlessItIsGiven) {
  const auto memory = [](std::uint64_t machine, const char* text) {
    Surroundings around;
    around.memory_bytes = machine;
    const Parsed parsed = parse_config(yaml(text), Role::kServer, around);
    return side_options(parsed.config.value()).account.memory_bytes_max;
  };
  const char* nothing = "auth: {method: none}";
  EXPECT_EQ(memory(0, nothing), 512U << 20) << "not known";
  EXPECT_EQ(memory(8ULL << 30, nothing), 512U << 20);
  EXPECT_EQ(memory(1ULL << 30, nothing), 256U << 20);
  EXPECT_EQ(memory(128U << 20, nothing), 64U << 20);
  EXPECT_EQ(memory(1ULL << 30, "{auth: {method: none}, memory_max: 536870912}"), 512U << 20);
}

TEST(Config, TheLargestMessageFitsIntoTheMemoryOfTheMachine) {
  const auto parsed = [](std::uint64_t machine, const char* text) {
    Surroundings around;
    around.memory_bytes = machine;
    return parse_config(yaml(text), Role::kServer, around).config.value();
  };
  const auto largest = [](const Config& config) {
    return side_options(config).reassembly.message_bytes_max;
  };
  const char* nothing = "auth: {method: none}";
  EXPECT_EQ(largest(parsed(8ULL << 30, nothing)), 64U << 20);
  const Config small = parsed(128U << 20, nothing);
  EXPECT_EQ(largest(small), (64U << 20) / 3);
  EXPECT_THAT(small.warnings, Not(Contains(HasSubstr("max_message_size"))));
  const Config given = parsed(128U << 20, "{auth: {method: none}, max_message_size: 67108864}");
  EXPECT_EQ(largest(given), 64U << 20);
  EXPECT_THAT(given.warnings, Contains(HasSubstr("max_message_size")));
}

}  // namespace
}  // namespace connect_bridge
