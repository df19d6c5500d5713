// The fake network: connections with delay, jitter that keeps order, bandwidth and a small send
// buffer, and all their failures.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "sim/rng.hpp"
#include "sim/schedule.hpp"

namespace connect_bridge::sim {

// One WebSocket message as it is handed to the network.
struct FlatPacket {
  bool text = false;
  Bytes bytes;
};

// A process that has connections.
class Party {
 public:
  virtual ~Party() = default;
  [[nodiscard]] virtual bool listening() const = 0;
  virtual ConnectionId accept() = 0;  // the number of a connection that was dialled to it
  virtual void on_open(ConnectionId id) = 0;
  virtual void on_dial_failed(ConnectionId id, const std::string& reason) = 0;
  virtual void on_packet(ConnectionId id, FlatPacket packet) = 0;
  virtual void on_closed(ConnectionId id, std::optional<std::uint16_t> code) = 0;
  virtual std::optional<FlatPacket> pull(ConnectionId id) = 0;
};

struct PathPlan {
  Duration delay{};   // one way
  Duration jitter{};  // on top, per packet
  std::uint64_t bytes_per_second = 1'000'000;
  std::size_t send_buffer = 16384;  // a packet is pulled while less than this is unsent
  unsigned loss_permille = 0;       // packets that TCP has to repeat, with all behind them waiting
  // Behind all that, a relay that holds so many bytes at most, and the other leg from there. 0:
  // none.
  std::size_t relay_buffer = 0;
  Duration relay_delay{};
  std::uint64_t relay_bytes_per_second = 0;

  [[nodiscard]] bool has_relay() const { return relay_buffer > 0; }
  // Bytes on their way to a relay take its room, too: it passes on one buffer for each time of the
  // way at least.
  [[nodiscard]] std::uint64_t rate() const {
    if (!has_relay()) return bytes_per_second;
    const double way = std::chrono::duration<double>(delay + jitter).count();
    const double of_buffer = static_cast<double>(relay_buffer) / std::max(way, 1e-6);
    return std::min(
        {bytes_per_second, relay_bytes_per_second, static_cast<std::uint64_t>(of_buffer)});
  }
  [[nodiscard]] Duration one_way() const { return delay + relay_delay; }
};

// From one dialling process to the process it dials. Direction 0 is from the dialler.
struct Path {
  Party* client = nullptr;
  Party* server = nullptr;
  PathPlan plan;
  bool refuses = false;         // dials are refused
  bool swaps = false;           // the relay joins with somebody else, whom the client refuses
  TimePoint stalled_until{};    // nothing moves, nothing is lost
  TimePoint disturbed_until{};  // the last time at which the path was not what its plan says
  std::array<TimePoint, 2> busy_until{};
  std::uint64_t dials = 0;
};

class Network {
 public:
  Network(Schedule& schedule, Rng rng) : schedule_(schedule), rng_(rng) {}

  int add_path(Party& client, Party& server, const PathPlan& plan);
  Path& path(int id) { return *paths_[static_cast<std::size_t>(id)]; }
  // Which path a connection of a party uses.
  [[nodiscard]] int path_of(const Party& party, ConnectionId id) const;
  [[nodiscard]] int paths() const { return static_cast<int>(paths_.size()); }

  // ---- what parties do
  void dial(int path, ConnectionId id);
  void close(Party& party, ConnectionId id, std::uint16_t code);
  void poke(Party& party, ConnectionId id);  // there may be something to pull
  // The process is gone. The operating system informs its peers, or not at all.
  void died(Party& party, bool peers_notice);

  // ---- what the weather does
  void stall(int path, Duration how_long);
  void end_stall(int path);
  // Every connection of the path is gone. The parameters say which ends notice it at once.
  void cut(int path, bool client_notices, bool server_notices);
  void change(int path, const PathPlan& plan);
  void disturb(int path, Duration how_long);  // notes that the path was not itself

  // Whether what a party sends on a connection goes anywhere.
  [[nodiscard]] bool is_alive(const Party& party, ConnectionId id)
      const;  // Connections that were over before. To be called at times.
  void forget(TimePoint before);

 private:
  enum class EndState : std::uint8_t { kOpening, kOpen, kClosing, kGone };
  struct End {
    Party* party = nullptr;
    ConnectionId id;
    EndState state = EndState::kOpening;
  };
  struct Item {
    FlatPacket packet;
    std::optional<std::uint16_t> close;  // the last item of a pipe
  };
  struct Pipe {
    std::deque<Item> queue;
    std::size_t buffered = 0;
    bool sending = false;
    TimePoint last_arrival{};
    std::size_t at_relay = 0;  // bytes on their way there, or held there
    TimePoint relay_busy_until{}, relay_arrival{};
  };
  struct Connection {
    int path = 0;
    std::array<End, 2> ends;
    std::array<Pipe, 2> pipes;            // pipes[i] leads away from ends[i]
    bool dead = false;                    // what is sent goes nowhere
    std::optional<TimePoint> over_since;  // when forget() first saw that it is
  };

  void try_to_open(Connection& connection, int attempts);
  void pull(Connection& connection, std::size_t from);
  void send(Connection& connection, std::size_t from);
  void sent(Connection& connection, std::size_t from);
  void at_relay(Connection& connection, std::size_t from, const std::shared_ptr<Item>& item);
  void arrive(Connection& connection, std::size_t from, Item item);
  void end_closed(Connection& connection, std::size_t end, std::optional<std::uint16_t> code,
                  Duration delay);
  void wake(int path);
  static bool is_over(const Connection& connection);
  Connection* find(const Party& party, ConnectionId id, std::size_t& end) const;

  Schedule& schedule_;
  Rng rng_;
  std::vector<std::unique_ptr<Path>> paths_;
  std::vector<std::unique_ptr<Connection>> connections_;
};

}  // namespace connect_bridge::sim
