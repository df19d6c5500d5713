#include "core/base/cdr.hpp"

#include <gtest/gtest.h>

#include <array>

#include "core/base/hex.hpp"

namespace connect_bridge {
namespace {

TEST(CdrTest, WritesWhatItReads) {
  const Payload message = CdrWriter().u8(7).u32(0x01020304).string("ab").u8(9).take();
  EXPECT_EQ(to_hex(message.view()),
            "00010000"
            "07000000"
            "04030201"
            "03000000616200"
            "09");
  CdrReader reader(message.view());
  EXPECT_EQ(reader.u8(), 7);
  EXPECT_EQ(reader.u32(), 0x01020304U);
  EXPECT_EQ(reader.string(), "ab");
  EXPECT_EQ(reader.u8(), 9);
  EXPECT_FALSE(reader.u8());
}

TEST(CdrTest, ReadsNothingBeyondTheEnd) {
  const Payload message = CdrWriter().u8(1).string("name").take();
  for (std::size_t size = 0; size < message.size(); ++size) {
    CdrReader reader(message.view().first(size));
    reader.u8();
    EXPECT_FALSE(reader.string()) << size;
    EXPECT_FALSE(reader.u8()) << size;
  }
}

TEST(CdrTest, ReadsNoOtherRepresentation) {
  const Bytes big_endian{0, 0, 0, 0, 0, 0, 0, 1};
  EXPECT_FALSE(CdrReader(big_endian).u32());
}

TEST(HexTest, TakesExactlyItsDigits) {
  std::array<std::uint8_t, 2> out{};
  EXPECT_TRUE(from_hex("0aff", out));
  EXPECT_EQ(to_hex(out), "0aff");
  for (const char* wrong : {"", "0af", "0aff0", "0aFF", "0a f", "0agg"})
    EXPECT_FALSE(from_hex(wrong, out)) << wrong;
}

}  // namespace
}  // namespace connect_bridge
