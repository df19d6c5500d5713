#include "run/supervisor.hpp"

#include <sys/un.h>

#include <boost/asio/buffer.hpp>
#include <charconv>
#include <optional>

namespace connect_bridge {
namespace {

// One byte less than the field: a path ends with a zero.
constexpr std::size_t kAddressSizeMax = sizeof(sockaddr_un::sun_path) - 1;

constexpr int kFirstSocket = 3;
constexpr int kSocketsMax = 8;

std::optional<int> whole_number(const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

PassedSockets passed_sockets(int pid, const std::string& sockets_for, const std::string& count) {
  // Sockets for another process (a parent or ancestor) are not ours.
  if (whole_number(sockets_for) != pid)
    return {{}, "listen.address: systemd has passed no socket to this process (LISTEN_PID)"};
  const int sockets = whole_number(count).value_or(0);
  if (sockets < 1 || sockets > kSocketsMax)
    return {{}, "listen.address: systemd must pass 1 to 8 sockets (LISTEN_FDS)"};
  PassedSockets passed;
  for (int i = 0; i < sockets; ++i) passed.sockets.push_back(kFirstSocket + i);
  return passed;
}

Supervisor::Supervisor(boost::asio::io_context& io, std::string address) : socket_(io) {
  const bool is_abstract = address.starts_with('@');
  if (!is_abstract && !address.starts_with('/')) return;
  if (address.size() > kAddressSizeMax) return;
  if (is_abstract) address.front() = '\0';
  there_ = boost::asio::local::datagram_protocol::endpoint(address);
  boost::system::error_code ignored;
  socket_.open({}, ignored);
  socket_.non_blocking(true, ignored);
}

// READY is repeated until it has been taken: the queue of systemd may be full while a machine
// boots, and without READY it would stop the service. A lost WATCHDOG is followed by the next one.
void Supervisor::every_second() {
  const bool taken = tell(knows_start_ ? "WATCHDOG=1" : "READY=1\nWATCHDOG=1");
  knows_start_ = knows_start_ || taken;
}

void Supervisor::stopping() {
  tell("STOPPING=1");
}

bool Supervisor::tell(std::string_view text) {
  if (!socket_.is_open()) return false;
  boost::system::error_code error;
  socket_.send_to(boost::asio::buffer(text), there_, 0, error);
  return !error;
}

}  // namespace connect_bridge
