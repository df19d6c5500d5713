#include "net/tcp/traffic.hpp"

#include <linux/tcp.h>  // the C library's tcp_info is older than these counts
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstddef>

namespace connect_bridge {
namespace {

constexpr std::uint32_t kTcpHeader = 32;  // with time stamps
constexpr std::uint32_t kIpv4Header = 20;
constexpr std::uint32_t kIpv6Header = 40;

// A socket of IPv6 may carry IPv4.
bool is_ipv6(int socket) {
  sockaddr_in6 address{};
  socklen_t size = sizeof address;
  return ::getpeername(socket, reinterpret_cast<sockaddr*>(&address), &size) == 0 &&
         address.sin6_family == AF_INET6 && !IN6_IS_ADDR_V4MAPPED(&address.sin6_addr);
}

}  // namespace

std::uint32_t header_bytes_of(int socket) {
  return kTcpHeader + (is_ipv6(socket) ? kIpv6Header : kIpv4Header);
}

TcpCounts tcp_counts_of(int socket) {
  constexpr std::size_t kNeeded =
      offsetof(tcp_info, tcpi_dsack_dups) + sizeof(tcp_info::tcpi_dsack_dups);
  tcp_info info{};
  socklen_t size = sizeof info;
  if (::getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &size) != 0 || size < kNeeded) return {};
  const std::uint64_t unacked = info.tcpi_unacked - std::min(info.tcpi_sacked, info.tcpi_unacked);
  return {.sent_bytes = info.tcpi_bytes_sent,
          .received_bytes = info.tcpi_bytes_received,
          .sent_packets = info.tcpi_segs_out,
          .received_packets = info.tcpi_segs_in,
          .segments = info.tcpi_data_segs_out,
          .lost = info.tcpi_total_retrans - std::min(info.tcpi_dsack_dups, info.tcpi_total_retrans),
          .round_trip = std::chrono::microseconds(info.tcpi_rtt),
          .repairs = {.open = info.tcpi_sacked > 0,
                      .under_way_bytes = unacked * info.tcpi_snd_mss + info.tcpi_notsent_bytes,
                      .repeated = info.tcpi_total_retrans,
                      .segment_bytes = info.tcpi_snd_mss},
          .too_early = info.tcpi_rcv_ooopack};
}

void TrafficMeter::count(const TcpCounts& now) {
  if (now.sent_bytes < last_.sent_bytes || now.received_bytes < last_.received_bytes) return;
  if (now.sent_packets == 0 && now.received_packets == 0) return;
  const auto headers = [&](std::uint32_t packets, std::uint32_t before) {
    return std::uint64_t{header_bytes_} * (packets - before);  // modulo 2^32
  };
  total_ += {now.sent_bytes - last_.sent_bytes + headers(now.sent_packets, last_.sent_packets),
             now.received_bytes - last_.received_bytes +
                 headers(now.received_packets, last_.received_packets)};
  last_ = now;
}

Traffic traffic_of(int socket) {
  TrafficMeter meter(header_bytes_of(socket));
  meter.count(tcp_counts_of(socket));
  return meter.total();
}

}  // namespace connect_bridge
