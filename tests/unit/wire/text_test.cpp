#include "core/wire/text.hpp"

#include <gtest/gtest.h>

namespace connect_bridge {
namespace {

TEST(Text, IsUtf8WithoutControlCharacters) {
  EXPECT_TRUE(is_text(""));
  EXPECT_TRUE(is_text("/robot1/cmd_vel ~"));
  EXPECT_TRUE(is_text("\xc2\xa0"));          // U+00A0, the first behind C1
  EXPECT_TRUE(is_text("\xdf\xbf"));          // U+07FF
  EXPECT_TRUE(is_text("\xe0\xa0\x80"));      // U+0800
  EXPECT_TRUE(is_text("\xe2\x80\xa7"));      // U+2027
  EXPECT_TRUE(is_text("\xe2\x80\xaf"));      // U+202F
  EXPECT_TRUE(is_text("\xe2\x81\xa5"));      // U+2065
  EXPECT_TRUE(is_text("\xe2\x81\xaa"));      // U+206A
  EXPECT_TRUE(is_text("\xed\x9f\xbf"));      // U+D7FF
  EXPECT_TRUE(is_text("\xee\x80\x80"));      // U+E000
  EXPECT_TRUE(is_text("\xf0\x90\x80\x80"));  // U+10000
  EXPECT_TRUE(is_text("\xf4\x8f\xbf\xbf"));  // U+10FFFF
}

TEST(Text, IsNothingElse) {
  EXPECT_FALSE(is_text(std::string_view{"\0", 1}));
  EXPECT_FALSE(is_text("line\nline"));
  EXPECT_FALSE(is_text("\x1b[31m"));
  EXPECT_FALSE(is_text("\x7f"));
  EXPECT_FALSE(is_text("\xc2\x80"));          // U+0080, C1
  EXPECT_FALSE(is_text("\xc2\x9f"));          // U+009F, C1
  EXPECT_FALSE(is_text("\xe2\x80\xa8"));      // U+2028, the end of a line
  EXPECT_FALSE(is_text("\xe2\x80\xae"));      // U+202E, what follows runs to the left
  EXPECT_FALSE(is_text("\xe2\x81\xa6"));      // U+2066, the same
  EXPECT_FALSE(is_text("\xe2\x81\xa9"));      // U+2069, the end of it
  EXPECT_FALSE(is_text("\x80"));              // a continuation alone
  EXPECT_FALSE(is_text("\xc0\xaf"));          // overlong
  EXPECT_FALSE(is_text("\xc1\xbf"));          // overlong
  EXPECT_FALSE(is_text("\xe0\x9f\xbf"));      // overlong
  EXPECT_FALSE(is_text("\xf0\x8f\xbf\xbf"));  // overlong
  EXPECT_FALSE(is_text("\xed\xa0\x80"));      // a surrogate
  EXPECT_FALSE(is_text("\xf4\x90\x80\x80"));  // beyond U+10FFFF
  EXPECT_FALSE(is_text("\xf5\x80\x80\x80"));
  EXPECT_FALSE(is_text("\xff"));
  EXPECT_FALSE(is_text("a\xc3"));         // cut short
  EXPECT_FALSE(is_text("\xe2\x82"));      // cut short
  EXPECT_FALSE(is_text("\xe2\x82x"));     // not continued
  EXPECT_FALSE(is_text("\xf0\x90\x80"));  // cut short
}

TEST(Text, IsMadeByReplacingAndCuttingBetweenCharacters) {
  EXPECT_EQ(to_text("a\nb\xff", 10), "a?b?");
  EXPECT_EQ(to_text("\xe2\x82\xac\xe2\x82\xac", 5), "\xe2\x82\xac");
  EXPECT_EQ(to_text("abc", 0), "");
  EXPECT_TRUE(is_text(to_text("\xe2\x82", 10)));
}

}  // namespace
}  // namespace connect_bridge
