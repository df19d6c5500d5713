#include "net/site.hpp"

#include "net/proxy_header.hpp"

namespace connect_bridge {

std::string site_of(const boost::asio::ip::address& address) {
  const auto plain = plain_address(address);
  if (plain.is_loopback()) return "loopback";
  std::string bytes = plain.is_v4() ? "4" : "6";
  const auto take = [&](const auto& all, int count) {
    for (int i = 0; i < count; ++i) bytes += static_cast<char>(all[static_cast<std::size_t>(i)]);
  };
  if (plain.is_v4()) {
    take(plain.to_v4().to_bytes(), 3);
  } else {
    take(plain.to_v6().to_bytes(), 7);
  }
  return bytes;
}

}  // namespace connect_bridge
