// A relay, and those who come to it by hand.
#pragma once

#include <gtest/gtest.h>
#include <openssl/ssl.h>

#include <future>
#include <optional>

#include "net/relay/relay_door.hpp"
#include "net/relay/relay_wire.hpp"
#include "relay/relay.hpp"
#include "unit/net/tls/certificates.hpp"
#include "unit/net/websocket/harness.hpp"
#include "unit/relay/ticket_hello.hpp"
#include "unit/scratch.hpp"

namespace connect_bridge::test {

inline const std::string kNoSuchRobot{"\x15\x03\x03\x00\x02\x02\x70", 7};

inline Authority& relay_authority() {
  static Authority made{scratch_folder()};
  return made;
}

// A robot's token is its name and "-token".
struct ByName : Authenticator {
  Judgement judge(const Attempt& attempt, Stamp) override {
    const std::string token(attempt.credential.begin(), attempt.credential.end());
    const auto end = token.find("-token");
    if (end == std::string::npos || token == withdrawn) return {};
    const bool is_code = token.find("-token-of-a-line") != std::string::npos;
    return {Identity{token.substr(0, end), is_code ? Groups{kLineGroup} : Groups{}}, {}};
  }
  Refreshed refresh(Stamp) override { return {{}, {"looked"}, {}, {}}; }
  using Groups = std::vector<std::string>;
  static inline std::string withdrawn;
};

// Only this token, and no code any longer.
struct ByDigest : ByName {
  explicit ByDigest(const Digest& of) : digest(of) {}
  Judgement judge(const Attempt& attempt, Stamp) override {
    return sha256(attempt.credential) == digest ? Judgement{Identity{"robot7", {}}, {}}
                                                : Judgement{};
  }
  Digest digest;
};

// The ClientHello of somebody who wants to get to a robot.
inline std::string visitor_hello(const std::string& robot,
                                 const std::vector<std::string>& protocols = {}) {
  const auto with_length = [](const std::string& text) {
    return std::string{static_cast<char>(text.size() >> 8U), static_cast<char>(text.size())} + text;
  };
  const std::string kind_of_name(1, '\0');
  const std::string name = with_length(with_length(kind_of_name + with_length(robot)));
  const std::string offers =
      protocols.empty()
          ? ""
          : std::string("\0\x10", 2) + with_length(with_length(protocol_list(protocols)));
  const std::string extensions = with_length(std::string(2, '\0') + name + offers);
  const std::string body = "\x03\x03" + std::string(32, 'r') + std::string(1, '\0') +
                           with_length("\x13\x01") + std::string("\x01\x00", 2) + extensions;
  const std::string message = "\x01" + std::string(1, '\0') + with_length(body);
  return "\x16\x03\x01" + with_length(message);
}

struct AtRelay {
  explicit AtRelay(int calls = 30, AddressRanges proxies = {}) {
    const Authority::Files files = relay_authority().sign("relay", "IP:127.0.0.1");
    RelaySetup setup;
    setup.addresses = {"127.0.0.1"};
    setup.tls = TlsOptions{files.certificate, files.key};
    const auto hand_over = [this](const RobotNames::Taking& of,
                                  std::string& problem) -> std::unique_ptr<Authenticator> {
      if (hold) hold->wait();
      handed_over.push_back(of.robot);
      problem = no_room;
      return no_room.empty() ? std::make_unique<ByDigest>(of.token) : nullptr;
    };
    setup.names = RobotNames(std::make_unique<ByName>(), hand_over);
    setup.address_calls_at_once = calls;
    setup.proxies = std::move(proxies);
    setup.address_call_period = 800s;
    setup.twin_answer = 300ms;
    setup.known_twin_answer = 60s;
    relay = std::make_shared<Relay>(loop.io, std::move(setup),
                                    [this](LogLevel level, const std::string& text) {
                                      if (level == LogLevel::kWarn) warnings.push_back(text);
                                      if (level == LogLevel::kError) errors.push_back(text);
                                    });
    EXPECT_EQ(relay->open(), "");
  }
  ~AtRelay() {
    relay->close();
    loop.run_for(1ms);
  }
  [[nodiscard]] std::uint16_t port() const { return relay->port(); }

  [[nodiscard]] std::uint64_t refused(RelayRefusal why) const {
    return relay->status().refused[static_cast<std::size_t>(why)];
  }

  Loop loop;
  std::shared_ptr<Relay> relay;
  std::optional<std::shared_future<void>> hold;  // handing over waits for it
  std::vector<std::string> handed_over;
  std::string no_room;
  std::vector<std::string> warnings, errors;
};

inline std::string proxy_header(const std::string& address) {
  return "PROXY TCP4 " + address + " 192.0.2.1 4711 443\r\n";
}

// The control connection of a robot, by hand.
struct HandRobot {
  // `header`: of a proxy.
  HandRobot(AtRelay& at, const std::string& name, const std::string& token,
            const std::string& header = "", const std::string& process = "")
      : loop(at.loop) {
    std::string problem;
    TcpSocket socket(loop.io.get_executor());
    socket.connect({asio::ip::make_address("127.0.0.1"), at.port()});
    socket.send(asio::buffer(header));
    TlsOptions trusting;
    trusting.ca_file = relay_authority().ca;
    lines = std::make_shared<TlsLines>(std::move(socket), make_client_tls(trusting, problem));
    const std::string offer = process.empty() ? protocol_list({kRelayProtocol})
                                              : protocol_list({kRelayProtocol, process});
    SSL_set_alpn_protos(lines->tls(), view_of(offer).data(), static_cast<unsigned>(offer.size()));
    SSL_set_tlsext_host_name(lines->tls(), name.c_str());
    lines->shake_hands(false, {}, [this, token](ErrorCode error) {
      if (error) return static_cast<void>(ended = true);
      lines->open(kRelayLineMax, {[this](std::string_view line) { said.emplace_back(line); },
                                  [this](const Failure&) { ended = true; }});
      lines->say("login " + token);
    });
  }
  ~HandRobot() {
    lines->end();
    loop.run_for(1ms);
  }
  bool hears(std::size_t lines_said) {
    return loop.until([&] { return said.size() >= lines_said; });
  }
  // The ticket of the visitor in this line.
  [[nodiscard]] std::string ticket(std::size_t line) const { return said.at(line).substr(8, 64); }

  Loop& loop;
  std::shared_ptr<TlsLines> lines;
  std::vector<std::string> said;
  bool ended = false;
};

}  // namespace connect_bridge::test
