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
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/bind_handler.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

namespace connect_bridge {

namespace asio = boost::asio;
using ErrorCode = boost::system::error_code;
// The concrete executor: a type-erased one costs an indirection and often an allocation per
// operation.
using TcpSocket = asio::basic_stream_socket<asio::ip::tcp, asio::io_context::executor_type>;

// Not movable. One read and one write may be under way at a time (the WebSocket sees to that).
// Every operation keeps using the object until its handler runs: the owner must live that long.
class Transport {
 public:
  using executor_type = TcpSocket::executor_type;  // NOLINT: the name Asio asks for

  using Clock = std::chrono::steady_clock;

  explicit Transport(TcpSocket socket)
      : socket_(std::move(socket)), waits_(socket_.get_executor()) {}
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;

  executor_type get_executor() { return socket_.get_executor(); }
  TcpSocket& socket() { return socket_; }
  // Null until start_tls().
  SSL* tls() { return tls_ ? tls_->native_handle() : nullptr; }

  // Everything after this goes through TLS. The context must outlive the object.
  void start_tls(std::shared_ptr<asio::ssl::context> context);
  void async_tls_handshake(bool as_server, std::function<void(ErrorCode)> done);

  // Closes orderly: informs the peer, discards what still arrives, closes the socket. May never end
  // with a peer that does not answer: limit it with abort().
  void finish(std::function<void()> done);
  // Ends now, unsent data is lost. Operations under way complete with an error.
  void abort();

  // From now on a read takes more from the kernel than was asked for, if available, and keeps it
  // for the next ones. Beast reads a frame's head and the rest apart, and with less than the kernel
  // has a read cannot tell that it has emptied it: three system calls for each message without
  // this, one with it. TLS has a buffer of its own.
  void read_ahead() {
    if (!tls_ && !ahead_) ahead_.reset(new Ahead);
  }

  // From now on no read goes beyond the end of the next HTTP header. Beast 1.74 takes a body whose
  // announced length is beyond its limit, and memory for all of that, if it comes with its header.
  void stop_at_header_end() { header_end_ = 0; }

  // Asked before each read: until when it is to wait, if at all. Beast reads frames without content
  // without end before it has a message to report.
  void limit_reads(std::function<std::optional<Clock::time_point>()> wait_until) {
    wait_until_ = std::move(wait_until);
  }
  // What reads have given so far.
  [[nodiscard]] std::uint64_t read_bytes() const { return read_bytes_; }

  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    if (header_end_ < kHeaderEnd.size()) {
      const auto byte = asio::buffer(*asio::buffer_sequence_begin(buffers), 1);
      using Read = HeaderRead<std::decay_t<Handler>>;
      return read_now(byte, Read{this, std::forward<Handler>(handler), byte});
    }
    const auto wait_until = wait_until_ ? wait_until_() : std::nullopt;
    if (!wait_until) return read_now(buffers, std::forward<Handler>(handler));
    waits_.expires_at(*wait_until);
    using Read = WaitedRead<Buffers, std::decay_t<Handler>>;
    waits_.async_wait(Read{this, std::forward<Handler>(handler), buffers});
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
  // TLS handles messages of its own (new keys, sessions) without end before it has something for a
  // read. An honest peer sends some at the beginning, then one in millions of records.
  static constexpr std::uint64_t kTlsMessages = 16;
  static constexpr std::uint64_t kBytesOfTlsMessage = 1 << 20;
  static void on_tls_message(int sent, int version, int kind, const void* message,
                             std::size_t bytes, SSL* tls, void* transport);

  static constexpr std::size_t kAheadBytes = 32768;
  using Ahead = std::array<unsigned char, kAheadBytes>;
  static constexpr std::string_view kHeaderEnd = "\r\n\r\n";

  template <class Handler>
  struct OfRead {
    using executor_type = asio::associated_executor_t<Handler, TcpSocket::executor_type>;  // NOLINT
    Transport* of;
    Handler handler;

    [[nodiscard]] executor_type get_executor() const {
      return asio::get_associated_executor(handler, of->get_executor());
    }
    friend bool asio_handler_is_continuation(OfRead*) { return true; }
  };
  // Counts what was read. Keeps what is beyond the requested bytes, and reports the requested ones.
  template <class Handler>
  struct CountedRead : OfRead<Handler> {
    std::size_t asked;

    CountedRead(Transport* transport, Handler next, std::size_t bytes)
        : OfRead<Handler>{transport, std::move(next)}, asked(bytes) {}
    void operator()(ErrorCode error, std::size_t bytes) {
      if (this->of->floods_) error = make_error_code(boost::system::errc::protocol_error);
      this->of->ahead_begin_ = 0;
      this->of->ahead_end_ = bytes > asked ? bytes - asked : 0;
      this->of->read_bytes_ += std::min(bytes, asked);
      this->handler(error, std::min(bytes, asked));
    }
  };
  // Of one byte: a header has hundreds, and is read once.
  template <class Handler>
  struct HeaderRead : OfRead<Handler> {
    asio::mutable_buffer byte;

    HeaderRead(Transport* transport, Handler next, asio::mutable_buffer into)
        : OfRead<Handler>{transport, std::move(next)}, byte(into) {}
    void operator()(ErrorCode error, std::size_t bytes) {
      if (bytes > 0) this->of->on_header_byte(*static_cast<const char*>(byte.data()));
      this->handler(error, bytes);
    }
  };
  template <class Buffers, class Handler>
  struct WaitedRead : OfRead<Handler> {
    Buffers buffers;

    WaitedRead(Transport* transport, Handler next, const Buffers& into)
        : OfRead<Handler>{transport, std::move(next)}, buffers(into) {}
    // An aborted wait, too: then the socket tells what is wrong.
    void operator()(ErrorCode) { this->of->read_now(buffers, std::move(this->handler)); }
  };

  template <class Buffers, class Handler>
  void read_now(const Buffers& buffers, Handler&& handler) {
    using Read = CountedRead<std::decay_t<Handler>>;
    if (ahead_begin_ < ahead_end_) {
      const std::size_t n = asio::buffer_copy(
          buffers, asio::buffer(ahead_->data() + ahead_begin_, ahead_end_ - ahead_begin_));
      ahead_begin_ += n;
      read_bytes_ += n;
      return asio::post(get_executor(), boost::beast::bind_front_handler(
                                            std::forward<Handler>(handler), ErrorCode{}, n));
    }
    const asio::mutable_buffer first{*asio::buffer_sequence_begin(buffers)};
    const bool ahead = ahead_ && !tls_;
    const std::size_t asked = ahead ? first.size() : asio::buffer_size(buffers);
    Read read{this, std::forward<Handler>(handler), asked};
    if (tls_) return tls_->async_read_some(buffers, std::move(read));
    if (!ahead) return socket_.async_read_some(buffers, std::move(read));
    const std::array<asio::mutable_buffer, 2> both{first, asio::buffer(*ahead_)};
    socket_.async_read_some(both, std::move(read));
  }

  void on_header_byte(char byte) {
    const bool goes_on = byte == kHeaderEnd[header_end_];
    header_end_ = goes_on ? header_end_ + 1 : std::size_t{byte == kHeaderEnd[0]};
  }

  static constexpr std::size_t kRecordBytesMax = 16384;  // RFC 8446 section 5.1
  using Tls = asio::ssl::stream<TcpSocket&>;

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
  TcpSocket socket_;
  asio::steady_timer waits_;  // a read
  std::function<std::optional<Clock::time_point>()> wait_until_;
  std::uint64_t read_bytes_ = 0;
  std::size_t header_end_ = kHeaderEnd.size();  // so much of it was read
  std::shared_ptr<asio::ssl::context> context_;
  std::unique_ptr<Tls> tls_;
  bool tls_open_ = false;           // the handshake is over
  std::uint64_t tls_messages_ = 0;  // since then
  bool floods_ = false;             // by too many of them
  std::unique_ptr<Record> record_;
  std::unique_ptr<Ahead> ahead_;
  std::size_t ahead_begin_ = 0;  // what is left of it
  std::size_t ahead_end_ = 0;
};

}  // namespace connect_bridge
