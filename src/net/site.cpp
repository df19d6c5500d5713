#include "net/site.hpp"

#include "net/proxy_header.hpp"

namespace connect_bridge {
namespace {

// Addresses that are the same in many places. A network of them may be larger than that of a
// customer: each block counts as one.
constexpr const char* kPrivateBlocks[] = {"10.0.0.0/8",     "172.16.0.0/12", "192.168.0.0/16",
                                          "169.254.0.0/16", "fc00::/7",      "fe80::/10"};

}  // namespace

std::string site_of(const boost::asio::ip::address& address) {
  const auto plain = plain_address(address);
  if (plain.is_loopback()) return "loopback";
  std::string site = plain.is_v4() ? "4" : "6";
  for (const char* block : kPrivateBlocks)
    if (AddressRange::parse(block)->contains(plain)) return site + block;
  const auto take = [&](const auto& all, int count) {
    for (int i = 0; i < count; ++i) site += static_cast<char>(all[static_cast<std::size_t>(i)]);
  };
  if (plain.is_v4()) {
    take(plain.to_v4().to_bytes(), 3);
  } else {
    take(plain.to_v6().to_bytes(), 7);
  }
  return site;
}

}  // namespace connect_bridge
