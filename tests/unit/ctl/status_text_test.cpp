#include "ctl/status_text.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

std::string repeated(std::size_t times, const std::string& text) {
  std::string all;
  for (std::size_t i = 0; i < times; ++i) all += text;
  return all;
}

std::string nested(std::size_t depth) {
  return R"({"a":)" + std::string(depth - 1, '[') + std::string(depth - 1, ']') + "}";
}

TEST(StatusText, ReadsAStatus) {
  EXPECT_EQ(read_status(R"({"node": "/connect_server", "links": [{"peer": "x"}]})")["node"],
            "/connect_server");
  EXPECT_EQ(read_status_in_order(R"({"b": 1, "a": 2})").dump(), R"({"b":1,"a":2})");
}

TEST(StatusText, NothingElseIsOne) {
  for (const char* text : {"", "[]", "7", "{", "{}}", "<html>", "{\"a\": \"\xff\"}"})
    EXPECT_TRUE(read_status(text).is_null()) << text;
}

// Six megabytes of brackets took gigabytes, and all of the stack.
TEST(StatusText, BeyondALimitNothingIsKept) {
  EXPECT_TRUE(read_status(nested(kStatusDepthMax)).is_object());
  EXPECT_TRUE(read_status(nested(kStatusDepthMax + 1)).is_null());
  EXPECT_TRUE(read_status(std::string(6 << 20, '[')).is_null());
  EXPECT_TRUE(read_status_in_order(repeated(1 << 20, R"({"a":)")).is_null());
  const std::string fits = R"({"a":[0)" + repeated(kStatusValuesMax - 3, ",0") + "]}";
  EXPECT_TRUE(read_status(fits).is_object());
  EXPECT_TRUE(read_status(R"({"b":0,)" + fits.substr(1)).is_null());
  EXPECT_TRUE(read_status(R"({"a":")" + std::string(kStatusBytesMax, 'x') + "\"}").is_null());
}

}  // namespace
}  // namespace connect_bridge
