// The floor of any bridge: the sizes of ros_bench over one plain connection, without ROS.
// tools/bench/run drives it.
//
//   ws_bench echo kind=tcp|ws         listens on a free port: {"ready":true,"port":N}
//   ws_bench ping kind=tcp|ws port=   commands: ping size= samples= gap= burst= (so many at once),
//   flood size= seconds=
// Both take address= (default: loopback) and congestion= (TCP congestion control, default: the
// host's). tcp: a 4-byte length before each message. ws: Boost.Beast, binary, no compression; the
// client masks, as it must. Both with TCP_NODELAY and blocking calls: the fewest system calls that
// there can be. The first byte of a message says what the echo does with it: 0 echo, 1 nothing
// (flood), 2 answer with one byte.
#include <netinet/tcp.h>
#include <pthread.h>
#include <unistd.h>

#include <atomic>
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

void use_congestion_control(Tcp::socket& socket, const std::string& name) {
  if (name.empty()) return;
  const auto size = static_cast<socklen_t>(name.size());
  if (setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_CONGESTION, name.data(), size) != 0) {
    throw std::runtime_error("no congestion control " + name);
  }
}

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

void run_echo(bool websocket, const asio::ip::address& address, const std::string& congestion) {
  std::thread([] {  // ends with its runner
    Commands commands;
    while (!commands.ended()) (void)commands.next(60'000);
    _exit(0);
  })
      .detach();
  asio::io_context io;
  Tcp::acceptor acceptor(io, {address, 0});
  answer("{\"ready\":true,\"port\":" + std::to_string(acceptor.local_endpoint().port()) + "}");
  for (;;) {
    try {
      auto socket = acceptor.accept();
      use_congestion_control(socket, congestion);
      Connection connection(websocket, std::move(socket), true);
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
  const auto burst = options.count("burst", 1);
  std::vector<std::atomic<std::int64_t>> sent(burst);
  const auto send_all = [&] {
    for (auto& when : sent) {
      when = now_ns();
      connection.send(out);
    }
  };
  for (std::size_t i = 0; i < options.count("samples", 200); ++i) {
    // Large ones fill the buffers of both directions: they must be read meanwhile.
    std::optional<std::jthread> sender;
    if (burst > 1) {
      sender.emplace(send_all);
    } else {
      send_all();
    }
    for (const auto& when : sent) {
      connection.receive(in);
      times.push_back(static_cast<double>(now_ns() - when) / 1e6);
    }
    sleep_until(now_ns() + gap);
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

void run_ping(bool websocket, const Tcp::endpoint& server, const std::string& congestion) {
  asio::io_context io;
  Tcp::socket socket(io);
  socket.open(server.protocol());
  use_congestion_control(socket, congestion);
  socket.connect(server);
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
  const auto address = boost::asio::ip::make_address(options.text("address", "127.0.0.1"));
  const auto congestion = options.text("congestion", "");
  if (options.verb == "echo") {
    bench::run_echo(websocket, address, congestion);
  } else if (options.verb == "ping") {
    const auto port = static_cast<unsigned short>(options.count("port", 0));
    bench::run_ping(websocket, {address, port}, congestion);
  } else {
    std::fprintf(
        stderr,
        "usage: ws_bench echo kind=tcp|ws [address=] | ping kind=tcp|ws [address=] port=N\n");
    return 2;
  }
  return 0;
} catch (const std::exception& e) {
  std::fprintf(stderr, "ws_bench: %s\n", e.what());
  return 1;
}
