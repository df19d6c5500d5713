#include "core/wire/login.hpp"

#include <gtest/gtest.h>

#include "unit/wire/vectors.hpp"

// Layouts and malformed records are in tests/vectors; here is what vectors cannot say.
namespace connect_bridge {
namespace {

Token128 token(std::uint8_t first) {
  Token128 value;
  value.bytes[0] = first;
  return value;
}

Hello hello() {
  Hello record;
  record.side = token(1);
  record.node = "/client";
  return record;
}

Welcome welcome() {
  Welcome record;
  record.side = token(2);
  record.session = token(3);
  return record;
}

TEST(LoginRecords, LargestOnesFitTheLimit) {
  Hello largest_hello = hello();
  largest_hello.node.assign(kNodeBytesMax, 'n');
  Login largest_login{std::string(kMethodBytesMax, 'm'), Bytes(kCredentialBytesMax, 7)};
  Welcome largest_welcome = welcome();
  largest_welcome.node.assign(kNodeBytesMax, 'n');
  largest_welcome.identity.assign(kIdentityBytesMax, 'i');

  ASSERT_TRUE(decode_hello(encode(largest_hello)).ok());
  ASSERT_TRUE(decode_login(encode(largest_login)).ok());
  ASSERT_TRUE(decode_welcome(encode(largest_welcome)).ok());
  EXPECT_EQ(decode_login(encode(largest_login)).value().credential, largest_login.credential);
  EXPECT_LE(encode(largest_login).size(), kLoginRecordBytesMax);
}

TEST(LoginRecords, CredentialBeyondItsLimitIsRefusedByTheServerNotCut) {
  for (const std::size_t bytes : {kCredentialBytesMax + 1, std::size_t{100'000}}) {
    const auto login = decode_login(encode(Login{"token", Bytes(bytes, 7)}));
    ASSERT_FALSE(login.ok());
    EXPECT_EQ(login.error().code, CloseCode::kTooLarge);
  }
}

TEST(LoginRecords, WordsForPeopleAreCutAndCleaned) {
  Welcome record = welcome();
  record.identity = "eve\n\x1b[31m" + std::string(2 * kIdentityBytesMax, 'x');
  const auto read = decode_welcome(encode(record));
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read.value().identity.substr(0, 10), "eve??[31mx");
  EXPECT_EQ(read.value().identity.size(), kIdentityBytesMax);
}

TEST(LoginRecords, DeadAfterIsKeptInItsRange) {
  Welcome record = welcome();
  for (const auto& [told, read] : {std::pair{0U, 0U},
                                   {1U, kDeadAfterMsMin},
                                   {3000U, 3000U},
                                   {4'000'000'000U, kDeadAfterMsMax}}) {
    record.dead_after_ms = told;
    EXPECT_EQ(decode_welcome(encode(record)).value().dead_after_ms, read);
  }
}

TEST(LoginRecords, EveryProperPrefixIsRefused) {
  const Bytes whole_hello = encode(hello());
  const Bytes whole_login = encode(Login{"token", {1, 2, 3}});
  const Bytes whole_welcome = encode(welcome());
  for (std::size_t size = 0; size < whole_hello.size(); ++size) {
    EXPECT_FALSE(decode_hello(ByteView{whole_hello}.first(size)).ok());
  }
  for (std::size_t size = 0; size < whole_login.size(); ++size) {
    EXPECT_FALSE(decode_login(ByteView{whole_login}.first(size)).ok());
  }
  for (std::size_t size = 0; size < whole_welcome.size(); ++size) {
    EXPECT_FALSE(decode_welcome(ByteView{whole_welcome}.first(size)).ok());
  }
}

TEST(LoginRecords, AnotherGenerationIsToldWhichVersionsMeet) {
  const auto later = decode_hello(from_hex("52324348 0200 0500 00"));
  ASSERT_FALSE(later.ok());
  EXPECT_EQ(later.error().code, CloseCode::kVersion);
  EXPECT_NE(later.error().message.find("2 to 5"), std::string::npos);
}

}  // namespace
}  // namespace connect_bridge
