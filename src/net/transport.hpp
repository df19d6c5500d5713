// The byte stream below a WebSocket: TCP, or TLS over TCP. One type for both, so that the templates
// above are instantiated once. Private to src/net (heavy includes).
#pragma once

#include <algorithm>
#include <array>
#include <boost/asio/basic_stream_socket.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <functional>
#include <memory>
#include <utility>

namespace connect_bridge {

namespace asio = boost::asio;
using ErrorCode = boost::system::error_code;
// The concrete executor: a type-erased one costs an indirection and often an allocation per
// operation.
using Socket = asio::basic_stream_socket<asio::ip::tcp, asio::io_context::executor_type>;

// Not movable. One read and one write may be under way at a time (the WebSocket sees to that).
// Every operation keeps using the object until its handler runs: the owner must live that long.
class Transport {
 public:
  using executor_type = Socket::executor_type;  // NOLINT: the name Asio asks for

  explicit Transport(Socket socket) : socket_(std::move(socket)) {}
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;

  executor_type get_executor() { return socket_.get_executor(); }
  Socket& socket() { return socket_; }
  // Null until start_tls().
  SSL* tls() { return tls_ ? tls_->native_handle() : nullptr; }

  // Everything after this goes through TLS. The context must outlive the object.
  void start_tls(std::shared_ptr<asio::ssl::context> context);
  void async_tls_handshake(bool as_server, std::function<void(ErrorCode)> done);

  // Ends orderly: says so to the peer, discards what still comes, closes the socket. May take for
  // ever with a peer that does not answer: bound it with abort().
  void finish(std::function<void()> done);
  // Ends now, unsent data is lost. Operations under way complete with an error.
  void abort();

  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    if (tls_) {
      tls_->async_read_some(buffers, std::forward<Handler>(handler));
    } else {
      socket_.async_read_some(buffers, std::forward<Handler>(handler));
    }
  }

  template <class Buffers, class Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    if (tls_) {
      tls_->async_write_some(one_record(buffers), std::forward<Handler>(handler));
    } else {
      socket_.async_write_some(buffers, std::forward<Handler>(handler));
    }
  }

 private:
  static constexpr std::size_t kRecordBytesMax = 16384;  // RFC 8446 section 5.1
  using Tls = asio::ssl::stream<Socket&>;

  // Asio makes one TLS record of the first buffer only; a frame's header of two bytes would become
  // a record, and a segment, of its own.
  template <class Buffers>
  asio::const_buffer one_record(const Buffers& buffers) {
    const asio::const_buffer first{*asio::buffer_sequence_begin(buffers)};
    if (first.size() >= kRecordBytesMax) return asio::buffer(first, kRecordBytesMax);
    if (!record_) record_.reset(new Record);
    return asio::buffer(record_->data(), asio::buffer_copy(asio::buffer(*record_), buffers));
  }

  void drain(std::function<void()> done);

  using Record = std::array<unsigned char, kRecordBytesMax>;
  Socket socket_;
  std::shared_ptr<asio::ssl::context> context_;
  std::unique_ptr<Tls> tls_;
  std::unique_ptr<Record> record_;
};

}  // namespace connect_bridge
