#include "run/supervisor.hpp"

#include <sys/un.h>

#include <boost/asio/buffer.hpp>

namespace connect_bridge {
namespace {

// One less than fits: a path ends with a zero.
constexpr std::size_t kAddressSizeMax = sizeof(sockaddr_un::sun_path) - 1;

}  // namespace

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

// The word about the start is repeated until it has been taken: the queue of systemd may be full
// while a machine boots, and without that word it would end the service. A lost word for the
// watchdog is only followed by the next one.
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
