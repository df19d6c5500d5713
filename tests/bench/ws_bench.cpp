// The floor of any bridge: the sizes of ros_bench over one plain connection, without ROS.
// tools/bench/run drives it.
//
//   ws_bench echo kind=tcp|ws                 listens on a free port of loopback:
//   {"ready":true,"port":N} ws_bench ping kind=tcp|ws port=N          commands: ping size= samples=
//   gap=
//                                                       flood size= seconds=
// tcp: a 4-byte length before each message. ws: Boost.Beast, binary, no compression; the client
// masks, as it must. Both with TCP_NODELAY and blocking calls: the fewest system calls that there
// can be. The first byte of a message says what the echo does with it: 0 echo, 1 nothing (flood), 2
// answer with one byte.
#include <pthread.h>
#include <unistd.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <optional>
#include <thread>

#include "timing.hpp"

namespace bench {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
using Tcp = asio::ip::tcp;
using Bytes = std::vector<std::uint8_t>;

class Connection {
 public:
  Connection(bool websocket, Tcp::socket socket, bool server) : socket_(std::move(socket)) {
    socket_.set_option(Tcp::no_delay(true));
    if (!websocket) return;
    stream_.emplace(std::move(socket_));
    stream_->binary(true);
    stream_->auto_fragment(false);
    stream_->read_message_max(64 << 20);
    stream_->write_buffer_bytes(1 << 16);
    if (server) {
      stream_->accept();
    } else {
      stream_->handshake("bench", "/");
    }
  }
  void send(const Bytes& bytes) {
    if (stream_) {
      stream_->write(asio::buffer(bytes));
      return;
    }
    const auto size = static_cast<std::uint32_t>(bytes.size());
    const std::array<asio::const_buffer, 2> parts{asio::buffer(&size, sizeof size),
                                                  asio::buffer(bytes)};
    asio::write(socket_, parts);
  }
  void receive(Bytes& bytes) {
    if (stream_) {
      auto buffer = asio::dynamic_buffer(bytes);
      bytes.clear();
      stream_->read(buffer);
      return;
    }
    std::uint32_t size = 0;
    asio::read(socket_, asio::buffer(&size, sizeof size));
    bytes.resize(size);
    asio::read(socket_, asio::buffer(bytes));
  }

 private:
  Tcp::socket socket_;
  std::optional<beast::websocket::stream<Tcp::socket>> stream_;
};

void run_echo(bool websocket) {
  std::thread([] {  // ends with its runner
    Commands commands;
    while (!commands.ended()) (void)commands.next(60'000);
    _exit(0);
  })
      .detach();
  asio::io_context io;
  Tcp::acceptor acceptor(io, {asio::ip::address_v4::loopback(), 0});
  answer("{\"ready\":true,\"port\":" + std::to_string(acceptor.local_endpoint().port()) + "}");
  for (;;) {
    try {
      Connection connection(websocket, acceptor.accept(), true);
      const Bytes one(1, 0);
      for (Bytes bytes;;) {
        connection.receive(bytes);
        if (bytes.empty() || bytes[0] == 0) connection.send(bytes);
        if (bytes[0] == 2) connection.send(one);
      }
    } catch (const std::exception&) {  // the peer has gone: wait for the next
    }
  }
}

std::string ping(Connection& connection, const Options& options) {
  Bytes out(std::max<std::size_t>(options.count("size", 12), 1)), in;
  fill(out.data(), out.size());
  out[0] = 0;
  const auto gap = static_cast<std::int64_t>(options.number("gap", 0.002) * 1e9);
  std::vector<double> times;
  for (std::size_t i = 0; i < options.count("samples", 200); ++i) {
    const auto sent = now_ns();
    connection.send(out);
    connection.receive(in);
    const auto now = now_ns();
    times.push_back(static_cast<double>(now - sent) / 1e6);
    sleep_until(now + gap);
  }
  return "{\"lost\":0,\"wrong\":0,\"ms\":" + json_array(times) + "}";
}

std::string flood(Connection& connection, const Options& options) {
  Bytes out(std::max<std::size_t>(options.count("size", 12), 1)), in;
  fill(out.data(), out.size());
  out[0] = 1;
  const auto start = now_ns();
  const auto end = start + static_cast<std::int64_t>(options.number("seconds", 2) * 1e9);
  std::uint32_t sent = 0;
  for (; now_ns() < end; ++sent) connection.send(out);
  out[0] = 2;
  connection.send(out);
  ++sent;
  connection.receive(in);
  const double seconds = static_cast<double>(now_ns() - start) / 1e9;
  char text[160];
  std::snprintf(text, sizeof text,
                "{\"sent\":%u,\"received\":%u,\"lost\":0,\"seconds\":%.4f,\"per_second\":%.2f}",
                sent, sent, seconds, sent / seconds);
  return text;
}

void run_ping(bool websocket, unsigned short port) {
  asio::io_context io;
  Tcp::socket socket(io);
  socket.connect({asio::ip::address_v4::loopback(), port});
  Connection connection(websocket, std::move(socket), false);
  Commands commands;
  answer("{\"ready\":true}");
  while (!commands.ended()) {
    const auto command = commands.next(60'000);
    if (!command) continue;
    answer(command->verb == "flood" ? flood(connection, *command) : ping(connection, *command));
  }
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) try {
  bench::Options options;
  for (int i = 1; i < argc; ++i) options.add(argv[i]);
  const bool websocket = options.text("kind", "ws") == "ws";
  if (options.verb == "echo") {
    bench::run_echo(websocket);
  } else if (options.verb == "ping") {
    bench::run_ping(websocket, static_cast<unsigned short>(options.count("port", 0)));
  } else {
    std::fprintf(stderr, "usage: ws_bench echo kind=tcp|ws | ping kind=tcp|ws port=N\n");
    return 2;
  }
  return 0;
} catch (const std::exception& e) {
  std::fprintf(stderr, "ws_bench: %s\n", e.what());
  return 1;
}
