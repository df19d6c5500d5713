#include "core/base/base64.hpp"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace connect_bridge {
namespace {

// RFC 4648 section 10.
TEST(Base64, EncodesTheVectorsOfItsRfc) {
  EXPECT_EQ(to_base64({}), "");
  EXPECT_EQ(to_base64(view_of("f")), "Zg==");
  EXPECT_EQ(to_base64(view_of("fo")), "Zm8=");
  EXPECT_EQ(to_base64(view_of("foo")), "Zm9v");
  EXPECT_EQ(to_base64(view_of("foobar")), "Zm9vYmFy");
  EXPECT_EQ(to_base64(Bytes{0xff, 0xef}), "/+8=");
}

TEST(Base64url, HasOneTextForEachValue) {
  EXPECT_EQ(from_base64url("AQID"), (Bytes{1, 2, 3}));
  EXPECT_EQ(from_base64url("_-8"), (Bytes{0xff, 0xef}));
  EXPECT_EQ(from_base64url(""), Bytes{});
  for (const char* wrong : {"A", "AQI=", "A+", "A/", "_+8", "AR", "AQJ", "AQ==", "A Q", "AQID\n",
                            " AQI", "AQI ", "AQ-\n", "----=", "AQIDA", "\xc3\xa9", "===="})
    EXPECT_FALSE(from_base64url(wrong).has_value()) << wrong;
  EXPECT_FALSE(from_base64url(std::string_view("AQ\0D", 4)).has_value());
}

TEST(Base64url, ReadsWhatItHasWritten) {
  Bytes bytes;
  for (int i = 0; i < 300; ++i) {
    const std::string text = to_base64url(bytes);
    EXPECT_EQ(text.find_first_of("+/="), std::string::npos);
    EXPECT_EQ(from_base64url(text), bytes);
    bytes.push_back(static_cast<std::uint8_t>(i * 151));
  }
}

}  // namespace
}  // namespace connect_bridge
