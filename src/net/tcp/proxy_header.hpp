// Reads the client's address as a proxy gives it: by the PROXY protocol before the first byte, or
// by X-Forwarded-For in the request. Pure; the caller checks that the proxy is trusted.
#pragma once

#include <boost/asio/ip/address.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/bytes.hpp"

namespace connect_bridge {

// A range of addresses with the same first bits: "10.0.0.0/8", "fd00::/8", "192.0.2.1".
class AddressRange {
 public:
  // Parses such a text; a zone is invalid.
  static std::optional<AddressRange> parse(std::string_view text);
  [[nodiscard]] bool contains(const boost::asio::ip::address& address) const;

 private:
  AddressRange(const boost::asio::ip::address& first, std::uint16_t bits)
      : first_(first), bits_(bits) {}

  boost::asio::ip::address first_;
  std::uint16_t bits_;
};
using AddressRanges = std::vector<AddressRange>;

[[nodiscard]] bool contain(const AddressRanges& ranges, const boost::asio::ip::address& address);

// The address as it is shown and counted: IPv4 in IPv6 notation becomes IPv4.
[[nodiscard]] boost::asio::ip::address plain_address(const boost::asio::ip::address& address);

// The network whose limits count together: the first bytes of an IPv6 address, or a whole IPv4
// address.
[[nodiscard]] std::string network_of(const boost::asio::ip::address& address, int bytes);

struct Source {
  boost::asio::ip::address address;
  std::uint16_t port = 0;  // 0: not known
};

// The result of reading the first bytes of a connection with the PROXY protocol, version 1 or 2
// (https://www.haproxy.org/download/2.8/doc/proxy-protocol.txt).
struct ProxyHeader {
  enum class State : std::uint8_t { kMore, kComplete, kWrong };
  State state = State::kMore;
  std::size_t missing = 0;       // kMore: at least so many further bytes belong to the header
  std::optional<Source> source;  // kComplete; none: the proxy connects for itself
};
// Reads the header. Without any bytes, `missing` is the number of bytes to read first. A header has
// at most 2064 bytes.
[[nodiscard]] ProxyHeader read_proxy_header(ByteView bytes);

// The client's address from the lines of X-Forwarded-For, in their order. Each proxy adds its
// neighbour at the right: the result is the first entry from the right that is not a trusted proxy.
// If that entry is not an address, the entry at its right is the last known one; nullopt: there is
// none.
[[nodiscard]] std::optional<Source> forwarded_source(const std::vector<std::string_view>& lines,
                                                     const AddressRanges& trusted);

}  // namespace connect_bridge
