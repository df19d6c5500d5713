#include "net/tcp/socket_tuning.hpp"

#include <linux/sockios.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "net/tcp/congestion_choice.hpp"
#include "net/tcp/traffic.hpp"

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

bool set(int socket, int level, int option, int value) {
  return ::setsockopt(socket, level, option, &value, sizeof value) == 0;
}

constexpr int kTcpRtoMaxMs = 44;  // TCP_RTO_MAX_MS: the headers of older kernels do not have it

}  // namespace

bool set_congestion_control(int socket, std::string_view name) {
  return ::setsockopt(socket, IPPROTO_TCP, TCP_CONGESTION, name.data(),
                      static_cast<socklen_t>(name.size())) == 0;
}

std::string tune_socket(int socket, const SocketOptions& options) {
  std::string refused;
  const auto note = [&refused](const std::string& what) {
    refused += (refused.empty() ? "" : "; ") + what + ": " + std::strerror(errno);
  };
  if (!set(socket, IPPROTO_TCP, TCP_NODELAY, 1)) note("TCP_NODELAY");
  if (options.unsent_bytes_max > 0 &&
      !set(socket, IPPROTO_TCP, TCP_NOTSENT_LOWAT, static_cast<int>(options.unsent_bytes_max))) {
    note("TCP_NOTSENT_LOWAT");
  }
  if (options.user_timeout.count() > 0 &&
      !set(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, static_cast<int>(options.user_timeout.count()))) {
    note("TCP_USER_TIMEOUT");
  }
  if (options.keepalive.count() > 0) {
    const int seconds = static_cast<int>(options.keepalive.count());
    if (!set(socket, SOL_SOCKET, SO_KEEPALIVE, 1) ||
        !set(socket, IPPROTO_TCP, TCP_KEEPIDLE, seconds) ||
        !set(socket, IPPROTO_TCP, TCP_KEEPINTVL, seconds)) {
      note("SO_KEEPALIVE");
    }
  }
  // Fewer than four segments under way are repeated six times before TCP doubles its time.
  set(socket, IPPROTO_TCP, TCP_THIN_LINEAR_TIMEOUTS, 1);
  limit_retry(socket);
  const std::string& congestion = options.congestion_control;
  if (congestion == "auto") {
    if (!set_congestion_control(socket, CongestionChoice::kFirst)) note("congestion control cubic");
  } else if (!congestion.empty() && congestion != "host" &&
             !set_congestion_control(socket, congestion)) {
    note("congestion control " + congestion);
  }
  return refused;
}

void set_unsent_bytes_max(int socket, std::uint32_t bytes) {
  set(socket, IPPROTO_TCP, TCP_NOTSENT_LOWAT, static_cast<int>(bytes));
}

std::uint32_t unsent_bytes(int socket) {
  int bytes = 0;
  if (::ioctl(socket, SIOCOUTQNSD, &bytes) != 0 || bytes < 0) return 0;
  return static_cast<std::uint32_t>(bytes);
}

std::chrono::milliseconds longest_retry(std::chrono::microseconds round_trip) {
  return std::clamp<std::chrono::milliseconds>(
      std::chrono::duration_cast<std::chrono::milliseconds>(4 * round_trip), 1s, 120s);
}

void limit_retry(int socket) {
  set(socket, IPPROTO_TCP, kTcpRtoMaxMs,
      static_cast<int>(longest_retry(tcp_counts_of(socket).round_trip).count()));
}

}  // namespace connect_bridge
