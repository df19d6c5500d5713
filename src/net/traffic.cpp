#include "net/traffic.hpp"

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

// IPv4 may come over a socket of IPv6.
bool is_ipv6(int socket) {
  sockaddr_in6 address{};
  socklen_t size = sizeof address;
  return ::getpeername(socket, reinterpret_cast<sockaddr*>(&address), &size) == 0 &&
         address.sin6_family == AF_INET6 && !IN6_IS_ADDR_V4MAPPED(&address.sin6_addr);
}

// Nullopt: not all of it up to `end` is known.
std::optional<tcp_info> info_of(int socket, std::size_t end) {
  tcp_info info{};
  socklen_t size = sizeof info;
  if (::getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &size) != 0 || size < end)
    return std::nullopt;
  return info;
}

}  // namespace

std::optional<TrafficCounts> traffic_counts_of(int socket) {
  const auto info =
      info_of(socket, offsetof(tcp_info, tcpi_bytes_sent) + sizeof(tcp_info::tcpi_bytes_sent));
  if (!info) return std::nullopt;
  return TrafficCounts{info->tcpi_bytes_sent, info->tcpi_bytes_received, info->tcpi_segs_out,
                       info->tcpi_segs_in,
                       kTcpHeader + (is_ipv6(socket) ? kIpv6Header : kIpv4Header)};
}

void TrafficMeter::count(const TrafficCounts& now) {
  if (now.sent_bytes < last_.sent_bytes || now.received_bytes < last_.received_bytes) return;
  if (now.sent_segments == 0 && now.received_segments == 0) return;
  const auto headers = [&](std::uint32_t segments, std::uint32_t before) {
    return std::uint64_t{now.header_bytes} * (segments - before);  // modulo 2^32
  };
  total_ += {now.sent_bytes - last_.sent_bytes + headers(now.sent_segments, last_.sent_segments),
             now.received_bytes - last_.received_bytes +
                 headers(now.received_segments, last_.received_segments)};
  last_ = now;
}

TcpLosses tcp_losses_of(int socket) {
  const auto info = info_of(
      socket, offsetof(tcp_info, tcpi_notsent_bytes) + sizeof(tcp_info::tcpi_notsent_bytes));
  if (!info) return {};
  const std::uint64_t segments =
      info->tcpi_unacked - std::min(info->tcpi_sacked, info->tcpi_unacked);
  return {.repairs = {.open = info->tcpi_sacked > 0,
                      .under_way_bytes = segments * info->tcpi_snd_mss + info->tcpi_notsent_bytes,
                      .repeated = info->tcpi_total_retrans,
                      .segment_bytes = info->tcpi_snd_mss},
          .too_early = info->tcpi_rcv_ooopack};
}

std::chrono::microseconds tcp_round_trip_of(int socket) {
  const auto info = info_of(socket, offsetof(tcp_info, tcpi_rtt) + sizeof(tcp_info::tcpi_rtt));
  return std::chrono::microseconds(info ? info->tcpi_rtt : 0);
}

std::optional<TcpCounts> tcp_counts_of(int socket) {
  const auto info =
      info_of(socket, offsetof(tcp_info, tcpi_dsack_dups) + sizeof(tcp_info::tcpi_dsack_dups));
  if (!info) return std::nullopt;
  const auto repeated = info->tcpi_total_retrans;
  return TcpCounts{info->tcpi_data_segs_out, repeated - std::min(info->tcpi_dsack_dups, repeated),
                   std::chrono::microseconds(info->tcpi_rtt)};
}

}  // namespace connect_bridge
