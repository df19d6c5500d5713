#include "net/tcp/transport.hpp"

#include <algorithm>
#include <boost/asio/ssl/stream.hpp>
#include <span>

namespace connect_bridge {

struct Transport::Tls : asio::ssl::stream<TcpSocket&> {
  using asio::ssl::stream<TcpSocket&>::stream;
};

// Counts bytes that were read. Keeps those beyond the requested bytes, and reports the requested
// ones.
struct Transport::CountedRead {
  Transport* of;
  std::size_t asked;
  IoHandler handler;

  using allocator_type = IoHandler::allocator_type;  // NOLINT: the name Asio asks for
  [[nodiscard]] allocator_type get_allocator() const noexcept { return handler.get_allocator(); }
  friend bool asio_handler_is_continuation(CountedRead*) { return true; }
  void operator()(ErrorCode error, std::size_t bytes) {
    if (of->floods_) error = make_error_code(boost::system::errc::protocol_error);
    of->ahead_begin_ = 0;
    of->ahead_end_ = bytes > asked ? bytes - asked : 0;
    of->read_bytes_ += std::min(bytes, asked);
    handler(error, std::min(bytes, asked));
  }
};

// Reports bytes that an earlier read has taken.
struct Transport::ReadAhead {
  std::size_t bytes;
  IoHandler handler;

  using allocator_type = IoHandler::allocator_type;  // NOLINT: the name Asio asks for
  [[nodiscard]] allocator_type get_allocator() const noexcept { return handler.get_allocator(); }
  void operator()() { handler(ErrorCode{}, bytes); }
};

Transport::Transport(TcpSocket socket)
    : socket_(std::move(socket)), waits_(socket_.get_executor()) {}
Transport::~Transport() = default;

SSL* Transport::tls() {
  return tls_ ? tls_->native_handle() : nullptr;
}

void Transport::start_read(asio::mutable_buffer into, IoHandler handler) {
  if (header_end_ < kHeaderEnd.size()) {
    // Each read takes one byte: a header has hundreds, and is read once.
    const asio::mutable_buffer byte = asio::buffer(into, 1);
    auto read = [this, byte, next = std::move(handler)](ErrorCode error,
                                                        std::size_t bytes) mutable {
      if (bytes > 0) on_header_byte(*static_cast<const char*>(byte.data()));
      next(error, bytes);
    };
    return read_now(byte, IoHandler(reads_, std::move(read)));
  }
  const auto wait_until = wait_until_ ? wait_until_() : std::nullopt;
  if (!wait_until) return read_now(into, std::move(handler));
  waits_.expires_at(*wait_until);
  // An aborted wait leads to the read, too: then the socket reports the error.
  waits_.async_wait([this, into, next = std::move(handler)](ErrorCode) mutable {
    read_now(into, std::move(next));
  });
}

void Transport::read_now(asio::mutable_buffer into, IoHandler handler) {
  if (ahead_begin_ < ahead_end_) {
    const std::size_t n = asio::buffer_copy(
        into, asio::buffer(ahead_->data() + ahead_begin_, ahead_end_ - ahead_begin_));
    ahead_begin_ += n;
    read_bytes_ += n;
    return asio::post(get_executor(), ReadAhead{n, std::move(handler)});
  }
  CountedRead read{this, into.size(), std::move(handler)};
  if (tls_) return tls_->async_read_some(into, std::move(read));
  if (!ahead_) return socket_.async_read_some(into, std::move(read));
  const std::array<asio::mutable_buffer, 2> both{into, asio::buffer(*ahead_)};
  socket_.async_read_some(both, std::move(read));
}

void Transport::on_header_byte(char byte) {
  const bool goes_on = byte == kHeaderEnd[header_end_];
  header_end_ = goes_on ? header_end_ + 1 : std::size_t{byte == kHeaderEnd[0]};
}

void Transport::start_write(std::size_t pieces, IoHandler handler) {
  if (tls_) return tls_->async_write_some(one_record(pieces), std::move(handler));
  socket_.async_write_some(std::span<const asio::const_buffer>(pieces_.data(), pieces),
                           std::move(handler));
}

// Asio makes one TLS record of the first buffer only; a frame's header of two bytes would become
// a record, and a segment, of its own.
asio::const_buffer Transport::one_record(std::size_t pieces) {
  if (pieces_[0].size() >= kRecordBytesMax) return asio::buffer(pieces_[0], kRecordBytesMax);
  if (!record_) record_.reset(new Record);
  const std::span<const asio::const_buffer> all(pieces_.data(), pieces);
  return asio::buffer(record_->data(), asio::buffer_copy(asio::buffer(*record_), all));
}

void Transport::start_tls(std::shared_ptr<asio::ssl::context> context) {
  context_ = std::move(context);
  tls_ = std::make_unique<Tls>(socket_, *context_);
  SSL_set_msg_callback(tls(), &Transport::on_tls_message);
  SSL_set_msg_callback_arg(tls(), this);
}

void Transport::on_tls_message(int sent, int /*version*/, int kind, const void* /*message*/,
                               std::size_t /*bytes*/, SSL* /*tls*/, void* transport) {
  Transport& self = *static_cast<Transport*>(transport);
  if (sent != 0 || kind != SSL3_RT_HANDSHAKE || !self.tls_open_) return;
  if (++self.tls_messages_ <= kTlsMessages + self.read_bytes_ / kBytesOfTlsMessage) return;
  self.floods_ = true;
  self.abort();
}

void Transport::async_tls_handshake(bool as_server, std::function<void(ErrorCode)> done) {
  tls_->async_handshake(as_server ? Tls::server : Tls::client,
                        [this, done = std::move(done)](ErrorCode error) {
                          tls_open_ = !error;
                          done(error);
                        });
}

void Transport::finish(std::function<void()> done) {
  if (!socket_.is_open()) {
    asio::post(socket_.get_executor(), std::move(done));
    return;
  }
  if (!tls_ || SSL_is_init_finished(tls()) == 0) {
    drain(std::move(done));
    return;
  }
  tls_->async_shutdown([this, done = std::move(done)](ErrorCode) mutable {
    drain(std::move(done));  // an error changes nothing: the TCP connection is closed
  });
}

void Transport::drain(std::function<void()> done) {
  ErrorCode ignored;
  socket_.shutdown(TcpSocket::shutdown_send, ignored);
  // A close with unread data in the kernel sends a reset, which can destroy data that the peer has
  // not read yet: its close reason.
  if (!record_) record_.reset(new Record);
  socket_.async_read_some(asio::buffer(*record_),
                          [this, done = std::move(done)](ErrorCode error, std::size_t) mutable {
                            if (!error) return drain(std::move(done));
                            ErrorCode late;
                            socket_.close(late);
                            done();
                          });
}

void Transport::abort() {
  waits_.cancel();
  reset(socket_);
}

}  // namespace connect_bridge
