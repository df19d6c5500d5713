#include "net/tcp_doors.hpp"

#include <sys/socket.h>

#include <chrono>
#include <utility>

#include "core/ports/url.hpp"
#include "net/listen_at.hpp"
#include "net/steady_now.hpp"

namespace connect_bridge {
namespace {

constexpr std::chrono::milliseconds kAcceptRetry{100};

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
  const auto door = std::make_shared<Door>(io_);
  const ListenResult result = listen_at(door->acceptor, address, port, port_key_);
  if (!result.warning.empty()) events_.log(LogLevel::kWarn, result.warning);
  if (result.problem.empty()) doors_.push_back(door);
  return result.problem;
}

std::string TcpDoors::take(const std::vector<int>& sockets) {
  std::string problem;
  for (std::size_t i = 0; i < sockets.size() && problem.empty(); ++i) problem = take(sockets[i]);
  return problem;
}

std::string TcpDoors::take(int socket) {
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
  const auto door = std::make_shared<Door>(io_);
  ErrorCode error;
  door->acceptor.assign(family == AF_INET ? asio::ip::tcp::v4() : asio::ip::tcp::v6(), socket,
                        error);
  if (error) return "cannot use the socket that this process was given: " + error.message();
  doors_.push_back(door);
  return {};
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

void TcpDoors::on_accepted(const DoorPtr& door, const ErrorCode& error, TcpSocket socket) {
  if (!door->acceptor.is_open()) return;
  if (!error) events_.arrived(std::move(socket));
  if (!door->acceptor.is_open()) return;  // closed by that
  if (!error || error == asio::error::connection_aborted) return accept(door);
  // Out of file descriptors or memory: the kernel keeps them waiting, and asking again at once
  // would spin.
  if (const auto tries = no_room_.count({steady_now(), 0}))
    events_.log(LogLevel::kWarn,
                "cannot accept connections now: " + error.message() +
                    (*tries > 1 ? "; tried " + std::to_string(*tries) + " times" : ""));
  accept_later(door);
}

void TcpDoors::accept_later(const DoorPtr& door) {
  door->retry.expires_after(kAcceptRetry);
  door->retry.async_wait([weak = weak_from_this(), at = std::weak_ptr{door}](ErrorCode cancelled) {
    const auto self = weak.lock();
    const auto waiting = at.lock();
    if (self && waiting && !cancelled && waiting->acceptor.is_open()) self->accept(waiting);
  });
}

}  // namespace connect_bridge
