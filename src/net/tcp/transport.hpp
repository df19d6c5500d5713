// The byte stream below a WebSocket: TCP, or TLS over TCP. One type for both, and below it one type
// of handler, so that the templates on both sides are instantiated once. Private to src/net (heavy
// includes).
#pragma once

#include <array>
#include <boost/asio/basic_stream_socket.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <new>
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

// A handler that calls this member function with its arguments, if the object still exists.
template <class T, class... Gets>
auto if_alive(T* of, void (T::*then)(Gets...)) {
  return [weak = of->weak_from_this(), then](Gets... got) {
    if (const auto self = weak.lock()) ((*self).*then)(std::forward<Gets>(got)...);
  };
}

// Calls `then` after this time, unless the timer is cancelled or set again before.
template <class Then>
void call_after(asio::steady_timer& timer, asio::steady_timer::duration time, Then then) {
  timer.expires_after(time);
  timer.async_wait([then = std::move(then)](ErrorCode cancelled) {
    if (!cancelled) then();
  });
}

// Closes the socket with a reset: unsent and unread data is lost.
inline void reset(TcpSocket& socket) {
  ErrorCode ignored;
  socket.set_option(TcpSocket::linger(true, 0), ignored);
  socket.close(ignored);
}

// Memory of one block after another: a block that is given back is kept for the next one.
class BlockMemory {
 public:
  BlockMemory() = default;
  BlockMemory(const BlockMemory&) = delete;
  BlockMemory& operator=(const BlockMemory&) = delete;
  ~BlockMemory() { ::operator delete(spare_); }

  void* take(std::size_t bytes) {
    if (bytes > kBytes) return ::operator new(bytes);
    return spare_ ? std::exchange(spare_, nullptr) : ::operator new(kBytes);
  }
  void give_back(void* block, std::size_t bytes) {
    if (bytes > kBytes || spare_) return ::operator delete(block);
    spare_ = block;
  }

 private:
  static constexpr std::size_t kBytes = 512;  // the largest handler of Beast has some 300
  void* spare_ = nullptr;
};

template <class T>
struct BlockAllocator {
  using value_type = T;  // NOLINT: the name that allocators have

  explicit BlockAllocator(BlockMemory& of) : memory(&of) {}
  template <class Other>
  BlockAllocator(const BlockAllocator<Other>& other)  // NOLINT: allocators convert
      : memory(other.memory) {}

  T* allocate(std::size_t n) { return static_cast<T*>(memory->take(n * sizeof(T))); }
  void deallocate(T* block, std::size_t n) { memory->give_back(block, n * sizeof(T)); }
  template <class Other>
  bool operator==(const BlockAllocator<Other>& other) const {
    return memory == other.memory;
  }

  BlockMemory* memory;
};

// Memory for the reads of a connection, or for its writes, of which one is under way at a time.
struct StepMemory {
  BlockMemory handler;
  BlockMemory operation;  // Asio's
};

// The handler of a read or a write, of any type. Called once, in the thread of the io_context: a
// handler must have no executor, and no allocator, of its own.
class IoHandler {
 public:
  using allocator_type = BlockAllocator<std::byte>;  // NOLINT: the name Asio asks for

  // The memory lives as long as the handler, or as what only the handler keeps alive.
  template <class Handler>
  IoHandler(StepMemory& memory, Handler&& handler) : memory_(&memory) {
    using Type = Held<std::decay_t<Handler>>;
    void* const block = memory.handler.take(sizeof(Type));
    held_.reset(new (block) Type(memory.handler, std::forward<Handler>(handler)));
  }

  friend bool asio_handler_is_continuation(IoHandler*) { return true; }
  [[nodiscard]] allocator_type get_allocator() const noexcept {
    return allocator_type(memory_->operation);
  }
  void operator()(ErrorCode error, std::size_t bytes) { held_.release()->run(error, bytes); }

 private:
  struct Any {
    Any() = default;
    Any(const Any&) = delete;
    Any& operator=(const Any&) = delete;
    virtual void run(ErrorCode error, std::size_t bytes) = 0;  // and drops it
    virtual void drop() = 0;

   protected:
    ~Any() = default;
  };
  struct Drop {
    void operator()(Any* held) const { held->drop(); }
  };
  template <class Handler>
  struct Held final : Any {
    BlockMemory& memory;
    Handler handler;

    template <class From>
    Held(BlockMemory& of, From&& from) : memory(of), handler(std::forward<From>(from)) {}
    // The memory is free again for the operation that the handler may begin.
    void run(ErrorCode error, std::size_t bytes) override {
      Handler now = take();
      now(error, bytes);
    }
    // The handler may be the last to keep the memory's owner alive.
    void drop() override { static_cast<void>(take()); }

   private:
    Handler take() {
      Handler now = std::move(handler);
      BlockMemory& of = memory;
      this->~Held();
      of.give_back(this, sizeof(Held));
      return now;
    }
  };
  StepMemory* memory_;
  std::unique_ptr<Any, Drop> held_;
};

// Not movable. One read and one write may be under way at a time (the WebSocket guarantees that).
// Every operation uses the object until its handler runs: the owner must live that long.
class Transport {
 public:
  using executor_type = TcpSocket::executor_type;  // NOLINT: the name Asio asks for

  using Clock = std::chrono::steady_clock;

  explicit Transport(TcpSocket socket);
  ~Transport();
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;

  executor_type get_executor() { return socket_.get_executor(); }
  TcpSocket& socket() { return socket_; }
  // The TLS connection; null until start_tls().
  SSL* tls();

  // Sends everything after this through TLS. This object shares the context.
  void start_tls(std::shared_ptr<asio::ssl::context> context);
  void async_tls_handshake(bool as_server, std::function<void(ErrorCode)> done);

  // Closes in order: informs the peer, discards further data, closes the socket. May never complete
  // if the peer does not answer: limit it with abort().
  void finish(std::function<void()> done);
  // Closes now; unsent data is lost. Operations under way complete with an error.
  void abort();

  // A read takes more from the kernel than was requested, from now on and if available, and keeps
  // it for the next reads. Beast reads a frame's head and the rest apart. A read of less than the
  // kernel has cannot see that the kernel is empty: three system calls for each message without
  // this, one with it. TLS has a buffer of its own.
  void read_ahead() {
    if (!tls_ && !ahead_) ahead_.reset(new Ahead);
  }

  // No read goes beyond the end of the next HTTP header from now on. Beast 1.74 takes a body whose
  // announced length is beyond its limit, and memory for all of that, if it comes with its header.
  void stop_at_header_end() { header_end_ = 0; }

  // Sets a function that is called before each read: the time until which the read waits, if at
  // all. Beast reads frames without content endlessly before it has a message to report.
  void limit_reads(std::function<std::optional<Clock::time_point>()> wait_until) {
    wait_until_ = std::move(wait_until);
  }
  // Bytes that reads have returned so far.
  [[nodiscard]] std::uint64_t read_bytes() const { return read_bytes_; }

  // A read fills the first buffer that is not empty, at most.
  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    asio::mutable_buffer into;
    const auto end = asio::buffer_sequence_end(buffers);
    for (auto at = asio::buffer_sequence_begin(buffers); at != end && into.size() == 0; ++at)
      into = *at;
    start_read(into, IoHandler(reads_, std::forward<Handler>(handler)));
  }

  // A write takes the first buffers, as many as the kernel takes at a time.
  template <class Buffers, class Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    std::size_t count = 0;
    const auto end = asio::buffer_sequence_end(buffers);
    for (auto at = asio::buffer_sequence_begin(buffers); at != end && count < kPieces; ++at)
      pieces_[count++] = *at;
    start_write(count, IoHandler(writes_, std::forward<Handler>(handler)));
  }

 private:
  // TLS handles messages of its own (new keys, sessions) endlessly before it has data for a read.
  // An honest peer sends some at the beginning, then one in millions of records.
  static constexpr std::uint64_t kTlsMessages = 16;
  static constexpr std::uint64_t kBytesOfTlsMessage = 1 << 20;
  static void on_tls_message(int sent, int version, int kind, const void* message,
                             std::size_t bytes, SSL* tls, void* transport);

  static constexpr std::size_t kAheadBytes = 32768;
  using Ahead = std::array<unsigned char, kAheadBytes>;
  static constexpr std::string_view kHeaderEnd = "\r\n\r\n";

  static constexpr std::size_t kPieces = 64;  // Asio's limit; IOV_MAX is more
  struct CountedRead;
  struct ReadAhead;

  void start_read(asio::mutable_buffer into, IoHandler handler);
  void read_now(asio::mutable_buffer into, IoHandler handler);
  void start_write(std::size_t pieces, IoHandler handler);

  void on_header_byte(char byte);
  asio::const_buffer one_record(std::size_t pieces);
  static constexpr std::size_t kRecordBytesMax = 16384;  // RFC 8446 section 5.1
  struct Tls;

  void drain(std::function<void()> done);

  using Record = std::array<unsigned char, kRecordBytesMax>;
  StepMemory reads_, writes_;  // declared before what may hold a handler
  TcpSocket socket_;
  asio::steady_timer waits_;  // delays a read
  std::function<std::optional<Clock::time_point>()> wait_until_;
  std::uint64_t read_bytes_ = 0;
  std::size_t header_end_ = kHeaderEnd.size();  // characters of kHeaderEnd that were read
  std::shared_ptr<asio::ssl::context> context_;
  std::unique_ptr<Tls> tls_;
  bool tls_open_ = false;                           // the handshake is over
  std::uint64_t tls_messages_ = 0;                  // received since then
  bool floods_ = false;                             // the peer sent too many of them
  std::array<asio::const_buffer, kPieces> pieces_;  // of the write under way
  std::unique_ptr<Record> record_;
  std::unique_ptr<Ahead> ahead_;
  std::size_t ahead_begin_ = 0;  // the part that is left
  std::size_t ahead_end_ = 0;
};

}  // namespace connect_bridge
