#include "net/tcp/tcp_doors.hpp"

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <boost/asio/ip/v6_only.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/system/error_code.hpp>
#include <cerrno>
#include <chrono>
#include <utility>

#include "core/ports/url.hpp"
#include "net/tcp/descriptors.hpp"
#include "net/tcp/steady_now.hpp"

namespace connect_bridge {
namespace {

constexpr std::chrono::milliseconds kAcceptRetry{100};
constexpr char kTaken[] = " (a server that runs already, or another program: end that, or change ";

using ListeningSocket = asio::ip::tcp::acceptor;
using ListenPoint = asio::ip::tcp::endpoint;

// The option of IPv4 works for sockets of IPv6, too, and on older kernels as well: IPV6_FREEBIND
// came with Linux 4.15.
bool allow_absent_address(ListeningSocket& acceptor) {
  const int on = 1;
  return ::setsockopt(acceptor.native_handle(), IPPROTO_IP, IP_FREEBIND, &on, sizeof on) == 0;
}

// Binds. Returns whether the address is one that no interface has. The first try does without the
// option: only the kernel knows all its own addresses, such as those of 127.0.0.0/8.
bool bind_to(ListeningSocket& acceptor, const ListenPoint& endpoint, ErrorCode& error) {
  acceptor.bind(endpoint, error);
  if (error != boost::system::errc::address_not_available || !allow_absent_address(acceptor))
    return false;
  acceptor.bind(endpoint, error);
  return !error;
}

}  // namespace

std::string TcpDoors::open(std::vector<std::string> addresses, std::uint16_t port) {
  if (addresses == std::vector<std::string>{"*"}) {
    if (bind("::", port).empty()) return {};
    addresses = {"0.0.0.0"};  // a host without IPv6
  }
  std::string problem;
  for (std::size_t i = 0; i < addresses.size() && problem.empty(); ++i)
    problem = bind(addresses[i], i == 0 ? port : this->port());
  return problem;
}

std::string TcpDoors::bind(const std::string& address, std::uint16_t port) {
  ErrorCode error, ignored;
  const auto parsed = asio::ip::make_address(address == "localhost" ? "127.0.0.1" : address, error);
  if (error) return "cannot listen on '" + address + "': it is no IP address";
  const auto door = std::make_shared<Door>(io_);
  ListeningSocket& acceptor = door->acceptor;
  const ListenPoint endpoint{parsed, port};
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(ListeningSocket::reuse_address(true), error);
  if (!error && parsed.is_v6())
    acceptor.set_option(asio::ip::v6_only(!parsed.is_unspecified()), ignored);
  const bool absent = !error && bind_to(acceptor, endpoint, error);
  if (!error) acceptor.listen(ListeningSocket::max_listen_connections, error);
  if (error)
    return "cannot listen on " + host_and_port(parsed.to_string(), port) + ": " + error.message() +
           (error == asio::error::address_in_use ? kTaken + port_key_ + ")"
            : error == asio::error::access_denied
                ? " (a port below 1024 needs CAP_NET_BIND_SERVICE or a socket of systemd)"
                : "");
  doors_.push_back(door);
  if (absent)
    events_.log(LogLevel::kWarn,
                "no interface has the address of " +
                    host_and_port(parsed.to_string(), acceptor.local_endpoint(ignored).port()) +
                    " now: nobody can connect there before one has it (listen.address)");
  return {};
}

std::string TcpDoors::take(const std::vector<int>& sockets) {
  for (const int socket : sockets) {
    const auto option = [socket](int name) {
      int value = -1;
      socklen_t size = sizeof value;
      return getsockopt(socket, SOL_SOCKET, name, &value, &size) == 0 ? value : -1;
    };
    const int family = option(SO_DOMAIN);
    if ((family != AF_INET && family != AF_INET6) || option(SO_TYPE) != SOCK_STREAM ||
        option(SO_ACCEPTCONN) != 1)
      return "the socket " + std::to_string(socket) +
             " that this process was given does not listen for TCP";
    const auto kind = family == AF_INET ? asio::ip::tcp::v4() : asio::ip::tcp::v6();
    if (std::string problem = use(socket, kind); !problem.empty()) return problem;
  }
  return {};
}

std::string TcpDoors::use(int socket, const asio::ip::tcp& family) {
  const auto door = std::make_shared<Door>(io_);
  ErrorCode error;
  door->acceptor.assign(family, socket, error);
  if (error) return "cannot use the socket that this process was given: " + error.message();
  doors_.push_back(door);
  return {};
}

// Nobody can connect before listen(), and then the file's mode is right. Accepting needs nothing
// that only a TCP socket has.
std::string TcpDoors::open_file(const std::string& file) {
  if (file.size() >= sizeof(sockaddr_un::sun_path)) return file + ": the path is too long";
  ::unlink(file.c_str());
  ErrorCode error;
  asio::local::stream_protocol::acceptor made(io_);
  made.open({}, error);
  if (!error) made.bind({file}, error);
  if (!error && ::chmod(file.c_str(), S_IRUSR | S_IWUSR) != 0)
    error = {errno, boost::system::system_category()};
  if (!error) made.listen(asio::socket_base::max_listen_connections, error);
  const int socket = error ? -1 : made.release(error);
  return error ? file + ": " + error.message() : use(socket, asio::ip::tcp::v4());
}

std::uint16_t TcpDoors::port() const {
  ErrorCode ignored;
  return doors_.empty() ? std::uint16_t{0} : doors_[0]->acceptor.local_endpoint(ignored).port();
}

std::vector<std::string> TcpDoors::addresses() const {
  std::vector<std::string> texts;
  for (const DoorPtr& door : doors_) {
    ErrorCode ignored;
    const auto endpoint = door->acceptor.local_endpoint(ignored);
    texts.push_back(host_and_port(endpoint.address().to_string(), endpoint.port()));
  }
  return texts;
}

void TcpDoors::accept() {
  for (const DoorPtr& door : doors_) accept(door);
}

void TcpDoors::close() {
  for (const DoorPtr& door : doors_) {
    ErrorCode ignored;
    door->acceptor.close(ignored);
    door->retry.cancel();
  }
}

void TcpDoors::accept(const DoorPtr& door) {
  door->acceptor.async_accept(io_.get_executor(),
                              [weak = weak_from_this(), door](ErrorCode error, TcpSocket socket) {
                                if (const auto self = weak.lock())
                                  self->on_accepted(door, error, std::move(socket));
                              });
}

void TcpDoors::on_accepted(const DoorPtr& door, ErrorCode error, TcpSocket socket) {
  if (!door->acceptor.is_open()) return;
  if (!error && !leaves_descriptors(socket.native_handle())) {
    error = asio::error::no_descriptors;
    ErrorCode ignored;
    socket.close(ignored);
  }
  if (!error) events_.arrived(std::move(socket));
  if (!door->acceptor.is_open()) return;  // the event has closed it
  if (!error || error == asio::error::connection_aborted) return accept(door);
  // Descriptors or memory are lacking: the kernel keeps connections waiting, and a retry at once
  // would spin.
  if (const auto tries = no_room_.count({steady_now(), 0}))
    events_.log(LogLevel::kWarn,
                "cannot accept connections now: " + error.message() +
                    (*tries > 1 ? "; tried " + std::to_string(*tries) + " times" : ""));
  call_after(door->retry, kAcceptRetry, [weak = weak_from_this(), at = std::weak_ptr{door}] {
    const auto self = weak.lock();
    const auto waiting = at.lock();
    if (self && waiting && waiting->acceptor.is_open()) self->accept(waiting);
  });
}

}  // namespace connect_bridge
