// What a proxy sends about its client.
#include "net/tcp/proxy_header.hpp"

#include <gtest/gtest.h>

#include <string>

namespace connect_bridge::test {
namespace {

using State = ProxyHeader::State;

ProxyHeader read(std::string_view text) {
  return read_proxy_header({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}
std::string text_of_source(const std::optional<Source>& source) {
  return source ? source->address.to_string() + " " + std::to_string(source->port) : "none";
}
std::string version2(char command, char family, const std::string& body) {
  std::string text{"\r\n\r\n\0\r\nQUIT\n", 12};
  text += command;
  text += family;
  text += static_cast<char>(body.size() >> 8U);
  text += static_cast<char>(body.size() & 0xffU);
  return text + body;
}
const std::string kBody4{"\xcb\0\x71\x05\x0a\0\0\1\xc3\x50\1\xbb", 12};

AddressRanges ranges(const std::vector<std::string>& texts) {
  AddressRanges made;
  for (const std::string& text : texts) made.push_back(AddressRange::parse(text).value());
  return made;
}

TEST(ProxyHeader, Version1) {
  const ProxyHeader ipv4 = read("PROXY TCP4 203.0.113.5 10.0.0.1 50000 443\r\n");
  EXPECT_EQ(ipv4.state, State::kComplete);
  EXPECT_EQ(text_of_source(ipv4.source), "203.0.113.5 50000");
  EXPECT_EQ(text_of_source(read("PROXY TCP6 2001:db8::5 ::1 1 2\r\n").source), "2001:db8::5 1");
  EXPECT_EQ(text_of_source(read("PROXY TCP6 ::ffff:203.0.113.5 ::1 1 2\r\n").source),
            "203.0.113.5 1");
  EXPECT_EQ(read("PROXY UNKNOWN\r\n").state, State::kComplete);
  EXPECT_FALSE(read("PROXY UNKNOWN what ever\r\n").source);
  const std::string longest = "PROXY UNKNOWN " + std::string(91, 'x') + "\r\n";
  EXPECT_EQ(longest.size(), 107U);
  EXPECT_EQ(read(longest).state, State::kComplete);
  EXPECT_EQ(read(longest.substr(0, 14) + "x" + longest.substr(14)).state, State::kWrong);
}

TEST(ProxyHeader, Version2) {
  const ProxyHeader ipv4 = read(version2(0x21, 0x11, kBody4));
  EXPECT_EQ(ipv4.state, State::kComplete);
  EXPECT_EQ(text_of_source(ipv4.source), "203.0.113.5 50000");
  EXPECT_EQ(text_of_source(read(version2(0x21, 0x11, kBody4 + "more that is not read")).source),
            "203.0.113.5 50000");
  const std::string six = std::string{"\x20\1\x0d\xb8", 4} + std::string(11, '\0') + "\5" +
                          std::string(16, '\0') + std::string{"\0\1\0\2", 4};
  EXPECT_EQ(text_of_source(read(version2(0x21, 0x21, six)).source), "2001:db8::5 1");
  const std::string mapped = std::string(10, '\0') + std::string{"\xff\xff\xcb\0\x71\x05", 6} +
                             std::string(16, '\0') + std::string{"\0\1\0\2", 4};
  EXPECT_EQ(text_of_source(read(version2(0x21, 0x21, mapped)).source), "203.0.113.5 1");
  for (const std::string& own : {version2(0x20, 0x11, kBody4), version2(0x21, 0, ""),
                                 version2(0x20, 0, ""), version2(0x21, 0x31, kBody4)}) {
    EXPECT_EQ(read(own).state, State::kComplete);
    EXPECT_FALSE(read(own).source);
  }
}

// What follows belongs to TLS or HTTP, so never a byte too many is asked for.
TEST(ProxyHeader, NoByteBehindItIsRead) {
  for (const std::string& whole :
       {std::string{"PROXY TCP4 203.0.113.5 10.0.0.1 50000 443\r\n"},
        std::string{"PROXY UNKNOWN\r\n"}, version2(0x21, 0x11, kBody4), version2(0x20, 0, "")}) {
    std::size_t have = 0;
    ProxyHeader header = read("");
    while (header.state == State::kMore) {
      ASSERT_GT(header.missing, 0U);
      have += header.missing;
      ASSERT_LE(have, whole.size());
      header = read(std::string_view{whole}.substr(0, have));
    }
    EXPECT_EQ(header.state, State::kComplete);
    EXPECT_EQ(have, whole.size());
  }
}

TEST(ProxyHeader, WhatIsWrongIsRefused) {
  for (const std::string& text :
       {std::string{"GET / HTTP/1.1\r\n"}, std::string{"PROXY TCP4 203.0.113.5 10.0.0.1 50000\r\n"},
        std::string{"PROXY TCP4 203.0.113.5 10.0.0.1 50000 443 more\r\n"},
        std::string{"PROXY TCP4 robot 10.0.0.1 50000 443\r\n"},
        std::string{"PROXY TCP4 203.0.113.5 10.0.0.1 65536 443\r\n"},
        std::string{"PROXY UDP4 203.0.113.5 10.0.0.1 50000 443\r\n"},
        std::string{"PROXY TCP4 203.0.113.5 10.0.0.1 50000 443\n"},
        "PROXY TCP4 " + std::string(100, '1'), version2(0x22, 0x11, kBody4),
        version2(0x11, 0x11, kBody4), version2(0x21, 0x11, kBody4.substr(1)),
        version2(0x21, 0x11, std::string(2049, 'x'))})
    EXPECT_EQ(read(text).state, State::kWrong) << text;
}

TEST(AddressRange, HasTheFirstBits) {
  const auto has = [](const char* range, const char* address) {
    return AddressRange::parse(range).value().contains(boost::asio::ip::make_address(address));
  };
  EXPECT_TRUE(has("10.0.0.0/8", "10.255.1.2"));
  EXPECT_FALSE(has("10.0.0.0/8", "11.0.0.0"));
  EXPECT_TRUE(has("10.0.0.128/25", "10.0.0.200"));
  EXPECT_FALSE(has("10.0.0.128/25", "10.0.0.100"));
  EXPECT_TRUE(has("192.0.2.1", "192.0.2.1"));
  EXPECT_FALSE(has("192.0.2.1", "192.0.2.2"));
  EXPECT_TRUE(has("0.0.0.0/0", "192.0.2.2"));
  EXPECT_FALSE(has("0.0.0.0/0", "::1"));
  EXPECT_TRUE(has("fd00::/8", "fdff::1"));
  EXPECT_FALSE(has("fd00::/8", "fe80::1"));
  EXPECT_TRUE(has("fe80::/10", "fe80::1%1"));
  EXPECT_TRUE(has("2001:db8:0:80::/57", "2001:db8:0:ff::1"));
  EXPECT_FALSE(has("2001:db8:0:80::/57", "2001:db8:0:7f::1"));
  EXPECT_TRUE(has("::/0", "::1"));
  for (const char* text :
       {"", "10.0.0.0/33", "10.0.0.0/", "10.0.0.0/x", "robot", "::/129", "1.2.3"})
    EXPECT_FALSE(AddressRange::parse(text)) << text;
}

std::string forwarded_for(const std::vector<std::string_view>& lines,
                          const std::vector<std::string>& trusted = {"10.0.0.0/8"}) {
  return text_of_source(forwarded_source(lines, ranges(trusted)));
}

TEST(ForwardedSource, IsTheRightmostThatIsNoTrustedProxy) {
  EXPECT_EQ(forwarded_for({"203.0.113.5"}), "203.0.113.5 0");
  EXPECT_EQ(forwarded_for({"203.0.113.5, 10.0.0.7"}), "203.0.113.5 0");
  EXPECT_EQ(forwarded_for({"198.51.100.1", "203.0.113.5:4711", "10.1.1.1, 10.0.0.7"}),
            "203.0.113.5 4711");
  EXPECT_EQ(forwarded_for({"10.0.0.3, 10.0.0.7"}), "10.0.0.3 0") << "a proxy for itself";
  EXPECT_EQ(forwarded_for({"2001:db8::5"}), "2001:db8::5 0");
  EXPECT_EQ(forwarded_for({"[2001:db8::5]:99"}), "2001:db8::5 99");
}

TEST(ForwardedSource, WhatAClientWritesItselfIsNotBelieved) {
  EXPECT_EQ(forwarded_for({"192.0.2.66, 203.0.113.5"}), "203.0.113.5 0");
  EXPECT_EQ(forwarded_for({"nonsense, 203.0.113.5"}), "203.0.113.5 0");
  EXPECT_EQ(forwarded_for({"203.0.113.5, nonsense"}), "none");
  EXPECT_EQ(forwarded_for({"192.0.2.66, unknown, 10.0.0.7"}), "10.0.0.7 0");
  EXPECT_EQ(forwarded_for({""}), "none");
  EXPECT_EQ(forwarded_for({}), "none");
  EXPECT_EQ(forwarded_for({","}), "none");
}

}  // namespace
}  // namespace connect_bridge::test
