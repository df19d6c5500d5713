// A stranger who may log in and then does what the protocol forbids, or sends noise.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/ids.hpp"
#include "sim/hostile_services.hpp"
#include "sim/network.hpp"
#include "sim/rng.hpp"
#include "sim/schedule.hpp"
#include "sim/text_reader.hpp"

namespace connect_bridge::sim {

// Dials a server again and again, or is dialled by a client, and misbehaves. Some ways to do so
// must end the connection, and it checks that they do. Sometimes it follows the protocol exactly,
// however meaningless its messages are: then it checks that the peer does not end the connection.
class Hostile : public Party {
 public:
  // `secret` empty: it is dialled and plays the server.
  // `label`: of its requests.
  Hostile(Schedule& schedule, Network& network, Rng rng, std::string secret, std::uint32_t label);

  void set_path(int path) { path_ = path; }
  void start();
  void stop() { stopped_ = true; }

  [[nodiscard]] bool listening() const override { return serves() && !stopped_; }
  ConnectionId accept() override { return {++last_id_}; }
  void on_open(ConnectionId id) override;
  void on_dial_failed(ConnectionId id, const std::string& reason) override;
  void on_packet(ConnectionId id, FlatPacket packet) override;
  void on_closed(ConnectionId id, std::optional<std::uint16_t> code) override;
  std::optional<FlatPacket> pull(ConnectionId id) override;

  [[nodiscard]] std::uint64_t offences() const { return offences_; }
  [[nodiscard]] std::uint64_t tolerated() const { return tolerated_; }

 private:
  void dial();
  void log_in();
  void send_welcome();
  [[nodiscard]] bool serves() const { return secret_.empty(); }
  void act();
  void take_step();
  void expect_withdraws();
  void listen_to(const FlatPacket& packet);
  void commit_offence();
  void commit_service_offence();
  void expect_the_end(const std::string& offence, std::function<bool()> stands);
  void acknowledge();
  void send_noise();
  void send_mutated();
  void send_plausible();
  void send_binary(Bytes bytes);
  void send_text(const std::string& text);
  Bytes random_bytes(std::size_t most);
  std::string offer(std::uint32_t channel, const std::string& name);
  std::string listener(std::uint32_t number, const std::string& name);

  Schedule& schedule_;
  Network& network_;
  Rng rng_;
  std::string secret_;
  int path_ = 0;
  std::uint32_t last_id_ = 0;
  ConnectionId connection_;  // none: not connected
  bool welcome_ = false;     // the login is through
  int records_ = 0;          // of a client's login
  bool stopped_ = false;
  std::uint64_t offences_ = 0;
  std::uint64_t tolerated_ = 0;
  std::uint64_t received_ = 0;
  std::deque<FlatPacket> queue_;
  TextReader texts_;
  std::vector<FlatPacket> seen_;  // packets of the server, to be mutated
  HostileServices services_;
  bool strict_ = false;     // follows the protocol exactly, except for an offence at the end
  bool offended_ = false;   // and the offence has been
  std::string last_steps_;  // of a strict connection
  Token128 side_, session_;
};

}  // namespace connect_bridge::sim
