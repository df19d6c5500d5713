// Each parameter with each kind of value: it is taken, or the problem names it.
#include <gmock/gmock.h>

#include "config/config.hpp"
#include "config/key_search.hpp"

namespace connect_bridge {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::vector<ParameterValue>& value_kinds() {
  static const std::vector<ParameterValue> all = {
      true,
      std::int64_t{1},
      1.5,
      std::string{"~"},
      std::vector<bool>{true},
      std::vector<std::int64_t>{1},
      std::vector<double>{1.5},
      std::vector<std::string>{"~"},
      std::vector<std::string>{},
  };
  return all;
}

// An integer is a number, too; an empty list looks the same whatever it is of.
bool fits_kind(ParameterType type, const ParameterValue& value) {
  return type_of(value) == type ||
         (type == ParameterType::kDouble && type_of(value) == ParameterType::kInteger);
}

TEST(ConfigKinds, AValueOfAnotherKindIsNamedWithItsKey) {
  std::size_t refused = 0;
  for (const KeySpec& spec : key_table()) {
    for (const ParameterValue& value : value_kinds()) {
      if (fits_kind(spec.type, value)) continue;
      const Role role = is_used_by(spec, Role::kServer) ? Role::kServer : Role::kClient;
      const std::string key = key_of(spec, "a");
      const Parsed parsed = parse_config({{key, value}}, role, {});
      EXPECT_FALSE(parsed.config) << key;
      std::string told;
      for (const Problem& problem : parsed.problems)
        if (problem.key == key && !problem.value.empty()) told = to_text(problem);
      const std::string shown = spec.secret ? "(hidden)" : to_text(value);
      EXPECT_THAT(told, HasSubstr(key + ": " + shown + " is wrong, expected ")) << key;
      EXPECT_THAT(told, Not(testing::EndsWith("expected "))) << key;
      ++refused;
    }
  }
  EXPECT_GT(refused, 7 * key_table().size());
}

TEST(ConfigKinds, TheTimeOfASimulatorIsAskedForByTrueOrFalse) {
  for (const ParameterValue& value : value_kinds()) {
    const Parsed parsed = parse_config({{"use_sim_time", value}}, Role::kServer, {});
    std::string told;
    for (const Problem& problem : parsed.problems)
      if (problem.key == "use_sim_time") told = to_text(problem);
    EXPECT_EQ(told, type_of(value) == ParameterType::kBool
                        ? ""
                        : "use_sim_time: " + to_text(value) + " is wrong, expected true or false");
  }
}

}  // namespace
}  // namespace connect_bridge
