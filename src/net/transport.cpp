#include "net/transport.hpp"

namespace connect_bridge {

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
    drain(std::move(done));  // an error there changes nothing: the TCP connection ends
  });
}

void Transport::drain(std::function<void()> done) {
  ErrorCode ignored;
  socket_.shutdown(TcpSocket::shutdown_send, ignored);
  // Closing with unread data in the kernel sends a reset, which can destroy what the peer has not
  // read yet: its close reason.
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
  ErrorCode ignored;
  socket_.set_option(TcpSocket::linger(true, 0), ignored);
  socket_.close(ignored);
}

}  // namespace connect_bridge
