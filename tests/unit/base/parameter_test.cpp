#include "core/base/parameter.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

TEST(Parameter, ATextThatIsMissingOrNoTextIsEmpty) {
  const ParameterMap given{{"url", std::string{"ws://robot"}}, {"listen.port", std::int64_t{9090}}};
  EXPECT_EQ(string_at(given, "url"), "ws://robot");
  EXPECT_EQ(string_at(given, "listen.port"), "");
  EXPECT_EQ(string_at(given, "tls.ca"), "");
}

}  // namespace
}  // namespace connect_bridge
