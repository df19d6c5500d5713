// What a client reads of a server, and of a proxy before it: answers, and frames after an upgrade.
// Input: a flag byte, then what is said. With the flag 1 behind a right answer to the upgrade, with
// 2 by a proxy. Then the other end says no more.
#include <openssl/evp.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

#include "core/base/check.hpp"
#include "core/wire/login.hpp"
#include "fuzz/stand_in.hpp"
#include "net/websocket/network.hpp"

using namespace connect_bridge;

namespace {

constexpr std::size_t kPacketBytesMax = 4096;  // docs/protocol.md, "Limits": before login
constexpr std::size_t kReasonBytesMax = 123;   // RFC 6455 section 5.5
constexpr std::chrono::seconds kPatience{5};   // on a busy machine

// RFC 6455 section 4.2.2.
std::string accept_of(const std::string& request) {
  constexpr std::string_view kName = "Sec-WebSocket-Key: ";
  const auto at = request.find(kName);
  if (at == std::string::npos) return {};
  const auto begin = at + kName.size();
  const std::string key = request.substr(begin, request.find("\r\n", begin) - begin) +
                          "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int size = 0;
  EVP_Digest(key.data(), key.size(), digest, &size, EVP_sha1(), nullptr);
  unsigned char text[64];
  EVP_EncodeBlock(text, digest, static_cast<int>(size));
  return reinterpret_cast<const char*>(text);
}

class World {
 public:
  void dial(bool by_proxy, bool upgraded, std::string_view said) {
    ended_ = opened_ = false;
    DialOptions options;
    options.url.secure = false;
    options.url.host = "127.0.0.1";
    options.url.port = other_.port();
    options.url.target = "/";
    if (by_proxy) options.proxy = HttpProxy{"127.0.0.1", other_.port(), ""};
    network_.dial({++last_}, options);
    io_.restart();
    io_.poll();
    const int other = other_.accepted();
    CONNECT_CHECK(other >= 0);
    answer(other, by_proxy, upgraded, said);
    const auto late = std::chrono::steady_clock::now() + kPatience;
    while (!ended_) {
      io_.restart();
      io_.run_one_for(std::chrono::milliseconds(1));
      read(other);
      CONNECT_CHECK(std::chrono::steady_clock::now() < late);
    }
    CONNECT_CHECK(!opened_ || upgraded);  // nobody guesses the answer to a new key
    ::close(other);
  }

 private:
  void answer(int other, bool by_proxy, bool upgraded, std::string_view said) {
    asked_.clear();
    std::string words;
    if (upgraded) {
      if (by_proxy) {
        await_request(other);
        send(other, "HTTP/1.1 200 OK\r\n\r\n");
        asked_.clear();
      }
      await_request(other);
      words =
          "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: upgrade\r\n"
          "Sec-WebSocket-Protocol: " +
          std::string{kSubprotocol} + "\r\nSec-WebSocket-Accept: " + accept_of(asked_) + "\r\n\r\n";
    }
    send(other, words + std::string{said});
    ::shutdown(other, SHUT_WR);
  }

  void await_request(int other) {
    const auto late = std::chrono::steady_clock::now() + kPatience;
    while (asked_.find("\r\n\r\n") == std::string::npos) {
      io_.restart();
      io_.run_one_for(std::chrono::milliseconds(1));
      read(other);
      CONNECT_CHECK(std::chrono::steady_clock::now() < late);
    }
  }

  void read(int other) {
    char buffer[4096];
    for (ssize_t n = 1; n > 0;) {
      n = ::recv(other, buffer, sizeof buffer, MSG_DONTWAIT);
      if (n > 0) asked_.append(buffer, static_cast<std::size_t>(n));
    }
  }
  static void send(int other, const std::string& words) {
    ::send(other, words.data(), words.size(), MSG_NOSIGNAL);
  }

  void on(Input&& input) {
    if (const auto* failed = std::get_if<DialFailed>(&input)) {
      CONNECT_CHECK(!opened_ && !ended_);
      check_loggable(failed->why.text);
      CONNECT_CHECK(bool(failed->why));
      ended_ = true;
    }
    if (std::holds_alternative<ConnectionOpened>(input)) opened_ = true;
    if (const auto* packet = std::get_if<PacketReceived>(&input))
      CONNECT_CHECK(opened_ && !ended_ && packet->payload.size() <= kPacketBytesMax);
    if (const auto* closed = std::get_if<ConnectionClosed>(&input)) {
      // The reason is the other end's own words: the core makes them a text.
      CONNECT_CHECK(opened_ && !ended_ && closed->reason.size() <= kReasonBytesMax);
      ended_ = true;
    }
  }

  bool opened_ = false;
  bool ended_ = false;
  std::uint64_t last_ = 0;
  std::string asked_;
  const StandIn other_;
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
  const NoAlarm quiet;
  world.dial((data[0] & 2) != 0, (data[0] & 1) != 0, words_of(data, size));
  return 0;
}
