#include "net/tcp/descriptors.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

namespace connect_bridge {
namespace {

// Descriptors for sockets and shared memory of the middleware, threads' events, standard streams.
constexpr std::size_t kDescriptorsOfGraph = 128;

rlimit limit_of_descriptors() {
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  return limit;
}

}  // namespace

std::size_t raise_descriptors() {
  rlimit limit = limit_of_descriptors();
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
  return limit_of_descriptors().rlim_cur;
}

bool leaves_descriptors(int socket) {
  return static_cast<std::size_t>(socket) + kDescriptorsForFiles < limit_of_descriptors().rlim_cur;
}

std::string descriptors_problem(std::size_t clients, std::size_t others, std::size_t limit) {
  others += kDescriptorsForFiles + kDescriptorsOfGraph;
  if (clients + others <= limit) return {};
  return fmt::format(
      "connections_max: {} is wrong, expected {}a limit of at least {} file descriptors, and it is "
      "{} (LimitNOFILE of the systemd unit, or ulimit -Hn)",
      clients, limit > others ? fmt::format("at most {}, or ", limit - others) : "",
      clients + others, limit);
}

}  // namespace connect_bridge
