// How a proxy tells for whom it connects: the PROXY protocol before the first byte, X-Forwarded-For
// or Forwarded in the request. Pure; the caller has to know that the proxy may be believed.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "core/base/bytes.hpp"

namespace connect_bridge {

// Addresses of which the first bits are the same: "10.0.0.0/8", "fd00::/8", "192.0.2.1".
class AddressRange {
 public:
  static std::optional<AddressRange> parse(std::string_view text);
  [[nodiscard]] bool contains(const boost::asio::ip::address& address) const;

 private:
  boost::asio::ip::address first_;
  unsigned bits_ = 0;
};
using AddressRanges = std::vector<AddressRange>;

[[nodiscard]] bool contain(const AddressRanges& ranges, const boost::asio::ip::address& address);

// IPv4 addresses that are written as IPv6 ones are shown, and counted, as what they are.
[[nodiscard]] boost::asio::ip::address plain_address(const boost::asio::ip::address& address);

struct Source {
  boost::asio::ip::address address;
  std::uint16_t port = 0;  // 0: not told
};

// What is known after the first bytes of a connection with the PROXY protocol, version 1 or 2
// (https://www.haproxy.org/download/2.8/doc/proxy-protocol.txt).
struct ProxyHeader {
  enum class State : std::uint8_t { kMore, kComplete, kWrong };
  State state = State::kMore;
  std::size_t missing = 0;       // kMore: so many bytes belong to the header at least
  std::optional<Source> source;  // kComplete; without one the proxy speaks for itself
};
// Given no byte it tells how many to begin with. A header has at most 2064 bytes.
[[nodiscard]] ProxyHeader read_proxy_header(ByteView bytes);

enum class ForwardedBy : std::uint8_t { kXForwardedFor, kForwarded };  // RFC 7239

// The client's address in the lines of that header, in their order. Each proxy adds its neighbour
// at the right: the answer is the first from there that is no trusted proxy. Where an entry is no
// address the one at its right is the last that is known; nullopt: there is none.
[[nodiscard]] std::optional<Source> forwarded_source(ForwardedBy kind,
                                                     const std::vector<std::string_view>& lines,
                                                     const AddressRanges& trusted);

}  // namespace connect_bridge
