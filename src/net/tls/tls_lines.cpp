#include "net/tls/tls_lines.hpp"

#include <boost/asio/read_until.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/write.hpp>
#include <utility>

namespace connect_bridge {

struct TlsLines::Stream : asio::ssl::stream<TcpSocket&> {
  using asio::ssl::stream<TcpSocket&>::stream;
};

TlsLines::TlsLines(TcpSocket socket, TlsContext context)
    : socket_(std::move(socket)),
      context_(std::move(context)),
      stream_(std::make_unique<Stream>(socket_, *context_)) {}

TlsLines::~TlsLines() = default;

SSL* TlsLines::tls() {
  return stream_->native_handle();
}

void TlsLines::shake_hands(bool as_server, Bytes read_before, std::function<void(ErrorCode)> done) {
  shaken_ = std::move(done);
  read_before_ = std::move(read_before);
  const auto on_shaken = [self = shared_from_this()](ErrorCode error, std::size_t = 0) {
    self->read_before_.clear();
    if (const auto report = std::exchange(self->shaken_, nullptr)) report(error);
  };
  if (!as_server) return stream_->async_handshake(Stream::client, on_shaken);
  stream_->async_handshake(Stream::server, asio::buffer(read_before_), on_shaken);
}

void TlsLines::open(std::size_t line_max, Events events) {
  line_max_ = line_max;
  events_ = std::move(events);
  read();
}

void TlsLines::read() {
  asio::async_read_until(*stream_, asio::dynamic_buffer(line_, line_max_), '\n',
                         [self = shared_from_this()](ErrorCode error, std::size_t bytes) {
                           if (self->events_.line) self->on_read(error, bytes);
                         });
}

void TlsLines::on_read(const ErrorCode& error, std::size_t bytes) {
  if (error == asio::error::not_found)
    return fail({Cause::kTooLarge, "the other end sends a line that is too long"});
  if (error) return fail(failure_of(error, tls(), {}));
  const std::string line = line_.substr(0, bytes - 1);
  line_.erase(0, bytes);
  const auto report = events_.line;  // it may end this object's events
  report(line);
  if (events_.line) read();
}

void TlsLines::say(const std::string& line) {
  if (unsent_.size() + line.size() >= kUnsentMax)
    return fail({Cause::kSlowPeer, "the other end does not read"});
  unsent_ += line + '\n';
  if (sending_.empty()) write();
}

void TlsLines::write() {
  sending_ = std::exchange(unsent_, {});
  asio::async_write(*stream_, asio::buffer(sending_),
                    [self = shared_from_this()](ErrorCode error, std::size_t) {
                      self->sending_.clear();
                      if (error) return self->fail(failure_of(error, self->tls(), {}));
                      if (!self->unsent_.empty()) return self->write();
                      if (self->finishes_) self->end();
                    });
}

void TlsLines::fail(const Failure& why) {
  const auto ended = std::exchange(events_.ended, nullptr);
  end();
  if (ended) ended(why);
}

void TlsLines::finish() {
  events_ = {};
  finishes_ = true;
  if (sending_.empty()) end();
}

Traffic TlsLines::traffic() {
  return socket_.is_open() ? traffic_of(socket_.native_handle()) : traffic_;
}

void TlsLines::end() {
  shaken_ = nullptr;
  events_ = {};
  traffic_ = traffic();
  ErrorCode ignored;
  socket_.close(ignored);
}

}  // namespace connect_bridge
