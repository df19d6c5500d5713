// A TLS client made with OpenSSL alone: offers anything, also what ours never would.
#pragma once

#include <fcntl.h>
#include <openssl/err.h>
#include <openssl/ssl.h>

#include <functional>
#include <memory>
#include <string>

#include "unit/net/websocket/harness.hpp"

namespace connect_bridge::test {

class RawTls {
 public:
  using Context = std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)>;
  using Configure = std::function<void(SSL_CTX*)>;

  RawTls(std::uint16_t port, const Configure& configure, const char* from = "127.0.0.1")
      : context_(SSL_CTX_new(TLS_client_method()), &SSL_CTX_free),
        socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    // All that OpenSSL can, however weak.
    SSL_CTX_set_security_level(context_.get(), 0);
    SSL_CTX_set_min_proto_version(context_.get(), TLS1_VERSION);
    configure(context_.get());
    tls_ = SSL_new(context_.get());
    sockaddr_in address{};
    address.sin_family = AF_INET;
    ::inet_pton(AF_INET, from, &address.sin_addr);
    if (::bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) failed_ = true;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0)
      failed_ = true;
    ::fcntl(socket_, F_SETFL, O_NONBLOCK);
    SSL_set_fd(tls_, socket_);
  }
  ~RawTls() {
    SSL_free(tls_);
    ::close(socket_);
    ERR_clear_error();
  }
  RawTls(const RawTls&) = delete;
  RawTls& operator=(const RawTls&) = delete;

  // Whether the handshake succeeds.
  bool shakes(Loop& loop) {
    return completes(loop, [this] { return SSL_connect(tls_); });
  }
  // Repeats `step` until it ends well or fails.
  bool completes(Loop& loop, const std::function<int()>& step) {
    bool good = false;
    loop.until([&] {
      if (failed_) return true;
      ERR_clear_error();
      const int result = step();
      if (result > 0) return good = true;
      const int error = SSL_get_error(tls_, result);
      failed_ = error != SSL_ERROR_WANT_READ && error != SSL_ERROR_WANT_WRITE;
      return failed_;
    });
    return good;
  }
  // Whether the other side ends the connection.
  bool ends(Loop& loop) {
    char byte = 0;
    while (completes(loop, [&] { return SSL_read(tls_, &byte, 1); })) {
    }
    return failed_;
  }
  [[nodiscard]] SSL* tls() const { return tls_; }

 private:
  Context context_;
  int socket_;
  SSL* tls_ = nullptr;
  bool failed_ = false;
};

}  // namespace connect_bridge::test
