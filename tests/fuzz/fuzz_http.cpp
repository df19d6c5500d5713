// Input of strangers to a listener: the request and its headers, and the frames after an upgrade.
// Only packets within the limits before login are delivered. Input: a flag byte, then what is sent;
// with the flag 1 when a right request has been answered.
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>

#include "core/base/check.hpp"
#include "core/wire/login.hpp"
#include "fuzz/stand_in.hpp"
#include "net/websocket/network.hpp"

using namespace connect_bridge;

namespace {

// docs/protocol.md, "Limits": before login.
constexpr std::size_t kPacketBytesMax = 4096;
constexpr std::size_t kAllBytesMax = 16384;

class World {
 public:
  World() {
    ListenOptions options;
    options.port = 0;
    options.trusted_proxies = {"127.0.0.1"};
    CONNECT_CHECK(network_.listen(options).empty());
  }

  // `then` is sent when what `said` causes has happened.
  void meet(const std::string& said, const std::string& then) {
    opened_ = false;
    packet_bytes_ = 0;
    const int stranger = connected();
    std::string answer;
    for (const std::string& words : {said, then}) {
      if (::send(stranger, words.data(), words.size(), MSG_NOSIGNAL) < 0) break;
      settle(stranger, answer);
    }
    ::close(stranger);
    while (network_.counts().pending > 0 || network_.counts().open > 0 || !network_.all_closed()) {
      io_.restart();
      io_.run_one_for(std::chrono::milliseconds(1));
    }
    CONNECT_CHECK(answer.empty() || answer.starts_with("HTTP/1.1 "));
    CONNECT_CHECK(!opened_ || answer.starts_with("HTTP/1.1 101 "));
    CONNECT_CHECK(packet_bytes_ <= kAllBytesMax);
  }

 private:
  void settle(int stranger, std::string& answer) {
    char buffer[4096];
    for (int still = 0; still < 3;) {
      still = turn() ? 0 : still + 1;
      const ssize_t n = ::recv(stranger, buffer, sizeof buffer, MSG_DONTWAIT);
      if (n > 0) answer.append(buffer, static_cast<std::size_t>(n));
    }
  }

  // Whether anything has happened.
  bool turn() {
    io_.restart();
    const bool happened = io_.poll() > 0;
    return happened;
  }

  int connected() const {
    const NoAlarm quiet;
    const int made = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    // It ends with a reset: ports in TIME-WAIT would soon be all that there are.
    const linger at_once{1, 0};
    ::setsockopt(made, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(network_.listen_port());
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    CONNECT_CHECK(::connect(made, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
    return made;
  }

  void on(Input&& input) {
    if (std::holds_alternative<ConnectionOpened>(input)) opened_ = true;
    const auto* packet = std::get_if<PacketReceived>(&input);
    if (packet == nullptr) return;
    CONNECT_CHECK(opened_ && packet->payload.size() <= kPacketBytesMax);
    packet_bytes_ += packet->payload.size();
  }

  bool opened_ = false;
  std::size_t packet_bytes_ = 0;
  boost::asio::io_context io_;
  Network network_{io_,
                   {[this](Input&& input) { on(std::move(input)); },
                    [](ConnectionId, const Repairs&) { return std::nullopt; },
                    [this](PacketReceived&& packet) {
                      const ConnectionId connection = packet.connection;
                      on(std::move(packet));
                      network_.read_on(connection);
                    },
                    [](Log&&) {}}};
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static World world;
  if (size == 0) return 0;
  const std::string words{words_of(data, size)};
  if ((data[0] & 1) == 0) {
    world.meet(words, "");
  } else {
    world.meet(
        "GET / HTTP/1.1\r\nHost: robot\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
        "Sec-WebSocket-Protocol: " +
            std::string{kSubprotocol} + "\r\n\r\n",
        words);
  }
  return 0;
}
