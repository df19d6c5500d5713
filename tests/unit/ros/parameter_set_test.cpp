// What `ros2 param set` may set: each type of parameter with each kind of value.
#include <gmock/gmock.h>

#include "ros/parameters/parameter.hpp"

namespace connect_bridge::ros {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

const std::vector<ParameterValue>& set_kinds() {
  static const std::vector<ParameterValue> all = {
      true,
      std::int64_t{3},
      1.5,
      std::string{"abc"},
      Bytes{1},
      std::vector<bool>{true},
      std::vector<std::int64_t>{3},
      std::vector<double>{1.5},
      std::vector<std::string>{"abc"},
  };
  return all;
}

TEST(ParameterSet, AnotherKindIsRefusedByName) {
  for (const ParameterValue& type : set_kinds()) {
    for (const ParameterValue& given : set_kinds()) {
      ParameterDescriptor entry;
      entry.name = "some.key";
      entry.type = type_of(type);
      ParameterValue value = given;
      const SetResult result = check_value(entry, value);
      const bool is_number =
          entry.type == ParameterType::kDouble && type_of(given) == ParameterType::kInteger;
      EXPECT_EQ(result.successful, entry.type == type_of(given) || is_number);
      if (result.successful) {
        EXPECT_THAT(result.reason, IsEmpty());
        EXPECT_EQ(value, is_number ? ParameterValue{3.0} : given);
      } else {
        EXPECT_THAT(result.reason, HasSubstr("parameter {some.key} is of type {"));
        EXPECT_EQ(value, given);
      }
    }
  }
}

TEST(ParameterSet, AnEmptyListIsOneOfStrings) {
  for (ParameterValue value :
       {ParameterValue{std::vector<bool>{}}, ParameterValue{std::vector<std::int64_t>{}},
        ParameterValue{std::vector<double>{}}, ParameterValue{Bytes{}}}) {
    ParameterDescriptor entry;
    entry.type = ParameterType::kStrings;
    EXPECT_TRUE(check_value(entry, value).successful);
    EXPECT_EQ(value, ParameterValue{std::vector<std::string>{}});
  }
}

}  // namespace
}  // namespace connect_bridge::ros
