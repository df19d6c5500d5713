#include "relay/joint.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <boost/asio/write.hpp>
#include <utility>

namespace connect_bridge {
namespace {

// The peer has reset the connection, or does not answer: nothing can be read or written any more.
// Only reading or writing takes the error away.
bool is_gone(TcpSocket& socket) {
  tcp_info info{};
  socklen_t size = sizeof info;
  return ::getsockopt(socket.native_handle(), IPPROTO_TCP, TCP_INFO, &info, &size) == 0 &&
         info.tcpi_state == TCP_CLOSE;
}

}  // namespace

Joint::Joint(TcpSocket visitor, TcpSocket robot,
             std::function<void(bool to_robot, std::size_t)> passed)
    : visitor_(std::move(visitor)),
      robot_(std::move(robot)),
      passed_(std::move(passed)),
      last_(visitor_.socket.get_executor()) {}

void Joint::start(Bytes first, std::function<void()> ended) {
  first_ = std::move(first);
  ended_ = std::move(ended);
  write(visitor_, robot_, asio::buffer(first_));
  pass(robot_, visitor_);
}

void Joint::pass(End& from, End& to) {
  from.socket.async_read_some(asio::buffer(from.read), [self = shared_from_this(), &from, &to](
                                                           ErrorCode error, std::size_t bytes) {
    if (!self->ended_) return;
    if (error == asio::error::eof) return self->on_over(from, to);
    if (error) return self->finish(false);
    self->write(from, to, asio::buffer(from.read, bytes));
  });
}

void Joint::write(End& from, End& to, asio::const_buffer bytes) {
  from.held = true;
  asio::async_write(to.socket, bytes,
                    [self = shared_from_this(), &from, &to](ErrorCode error, std::size_t written) {
                      if (!self->ended_) return;
                      from.held = false;
                      if (error) return self->finish(false);
                      self->passed_(&to == &self->robot_, written);
                      self->pass(from, to);
                    });
}

void Joint::look() {
  // An end to which we have sent FIN, too, may have closed orderly, with bytes still to be read.
  const auto gone = [](End& end, const End& other) {
    return end.held && !other.over && is_gone(end.socket);
  };
  if (ended_ && (gone(visitor_, robot_) || gone(robot_, visitor_))) finish(false);
}

void Joint::on_over(End& from, End& to) {
  ErrorCode ignored;
  from.over = true;
  to.socket.shutdown(TcpSocket::shutdown_send, ignored);
  if (to.over) return finish(true);
  call_after(last_, kLastTime, [self = shared_from_this()] {
    if (self->ended_) self->finish(false);
  });
}

void Joint::finish(bool orderly) {
  const auto ended = std::exchange(ended_, nullptr);
  last_.cancel();
  for (End* const end : {&visitor_, &robot_}) {
    ErrorCode ignored;
    if (orderly) {
      end->socket.close(ignored);
    } else {
      reset(end->socket);
    }
  }
  ended();
}

void Joint::cut() {
  if (ended_) {
    ended_ = [] {};
    finish(false);
  }
}

}  // namespace connect_bridge
