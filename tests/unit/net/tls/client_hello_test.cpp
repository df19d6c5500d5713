#include "net/tls/client_hello.hpp"

#include <gtest/gtest.h>

#include "core/base/hex.hpp"
#include "net/relay/relay_wire.hpp"
#include "unit/relay/ticket_hello.hpp"

namespace connect_bridge {
namespace {

using State = ClientHello::State;

Bytes hello_for(const std::string& robot, const std::string& ticket = std::string(64, '7')) {
  const std::string text = test::ticket_hello(robot, ticket);
  return {text.begin(), text.end()};
}

// The same message in records of so many bytes.
Bytes cut_into_records(const Bytes& hello, std::size_t size) {
  Bytes cut;
  for (std::size_t at = 5; at < hello.size(); at += size) {
    const std::size_t part = std::min(size, hello.size() - at);
    cut.insert(cut.end(),
               {22, 3, 1, static_cast<std::uint8_t>(part >> 8U), static_cast<std::uint8_t>(part)});
    cut.insert(cut.end(), hello.begin() + static_cast<std::ptrdiff_t>(at),
               hello.begin() + static_cast<std::ptrdiff_t>(at + part));
  }
  return cut;
}

TEST(ClientHello, SaysForWhomItIsAndWhatItOffers) {
  const std::string ticket(64, 'a');
  const ClientHello hello = read_client_hello(hello_for("Robot-7", ticket));
  ASSERT_EQ(hello.state, State::kComplete);
  EXPECT_EQ(hello.server_name, "robot-7");
  EXPECT_EQ(hello.protocols, (std::vector<std::string>{kTicketProtocol, ticket}));
}

TEST(ClientHello, ComesInAnyPiecesAndNoByteMoreIsAskedFor) {
  const Bytes whole = hello_for("robot7");
  for (const Bytes& hello : {whole, cut_into_records(whole, 40), cut_into_records(whole, 255)}) {
    Bytes have;
    while (true) {
      const ClientHello read = read_client_hello(have);
      if (read.state == State::kComplete) break;
      ASSERT_EQ(read.state, State::kMore) << have.size();
      ASSERT_GT(read.missing, 0U);
      ASSERT_LE(have.size() + read.missing, hello.size());
      have.insert(have.end(), hello.begin() + static_cast<std::ptrdiff_t>(have.size()),
                  hello.begin() + static_cast<std::ptrdiff_t>(have.size() + read.missing));
    }
    EXPECT_EQ(have, hello);
    for (std::size_t size = 0; size < hello.size(); ++size)
      EXPECT_EQ(read_client_hello(ByteView(hello).first(size)).state, State::kMore) << size;
  }
}

TEST(ClientHello, WhatIsNoneIsWrongAtOnce) {
  for (const char* junk : {"47", "1602", "15", "160301000002", "16030100000", "1603014001"}) {
    Bytes bytes(std::string_view(junk).size() / 2);
    if (!from_hex(std::string_view(junk).substr(0, 2 * bytes.size()), bytes)) continue;
    EXPECT_EQ(read_client_hello(bytes).state, State::kWrong) << junk;
  }
  Bytes other_message = hello_for("robot7");
  other_message[5] = 2;
  EXPECT_EQ(read_client_hello(ByteView(other_message).first(6)).state, State::kWrong);
  Bytes more = hello_for("robot7");
  more[4] += 1;  // a byte behind the message, in its record
  EXPECT_EQ(read_client_hello(ByteView(more)).state, State::kWrong);
}

TEST(ClientHello, IsNotTooLongAndNotInTooManyRecords) {
  Bytes large = hello_for("robot7");
  large[6] = 0;  // of the length of the message
  large[7] = 0x3f;
  large[8] = 0xfc;  // 16,380 with its head, so more than 16,384 with that of its record
  EXPECT_EQ(read_client_hello(ByteView(large).first(9)).state, State::kWrong);
  const Bytes whole = hello_for("robot7");
  EXPECT_EQ(read_client_hello(cut_into_records(whole, whole.size() / 10)).state, State::kComplete);
  EXPECT_EQ(read_client_hello(cut_into_records(whole, whole.size() / 20)).state, State::kWrong);
}

TEST(ClientHello, NoLengthInItIsBelieved) {
  const Bytes whole = hello_for("robot7");
  // Each byte of the message that may be a length; the outer ones are checked above.
  for (std::size_t at = 9; at < whole.size(); ++at) {
    for (const std::uint8_t value : {std::uint8_t{0}, std::uint8_t{1}, std::uint8_t{255}}) {
      Bytes bent = whole;
      bent[at] = value;
      EXPECT_NE(read_client_hello(bent).state, State::kMore) << at;
    }
  }
}

TEST(ClientHello, MayHaveNoName) {
  const ClientHello hello = read_client_hello(hello_for("robot7"));
  EXPECT_TRUE(hello.state == State::kComplete);
  // TLS 1.2 without extensions: version, random, no session, one suite, one compression.
  Bytes old{22, 3, 1, 0, 45, 1, 0, 0, 41, 3, 3};
  old.resize(old.size() + 32);
  old.insert(old.end(), {0, 0, 2, 0xc0, 0x2f, 1, 0});
  const ClientHello plain = read_client_hello(old);
  EXPECT_EQ(plain.state, State::kComplete);
  EXPECT_EQ(plain.server_name, "");
  EXPECT_TRUE(plain.protocols.empty());
}

}  // namespace
}  // namespace connect_bridge
