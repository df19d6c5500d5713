#include "sim/network.hpp"

#include <algorithm>
#include <utility>

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

constexpr Duration kRetryDial = 50ms;
constexpr int kDialAttemptsMax = 400;  // 20 s, as long as a TCP connect is tried
constexpr Duration kCloseTimeout = 400ms;
constexpr Duration kRepair = 200ms;  // the least time-out of TCP in Linux

}  // namespace

int Network::add_path(Party& client, Party& server, const PathPlan& plan) {
  auto& path = *paths_.emplace_back(std::make_unique<Path>());
  path.client = &client;
  path.server = &server;
  path.plan = plan;
  return static_cast<int>(paths_.size()) - 1;
}

void Network::dial(int path_id, ConnectionId id) {
  auto& connection = *connections_.emplace_back(std::make_unique<Connection>());
  connection.path = path_id;
  Path& way = path(path_id);
  ++way.dials;
  connection.ends[0] = End{way.client, id, EndState::kOpening};
  connection.ends[1] = End{way.server, ConnectionId{}, EndState::kOpening};
  schedule_.after(2 * way.plan.one_way() + rng_.between(1us, 1ms),
                  [this, &connection] { try_to_open(connection, 0); });
}

void Network::try_to_open(Connection& connection, int attempts) {
  End& client = connection.ends[0];
  End& server = connection.ends[1];
  if (client.state != EndState::kOpening) return;
  Path& way = path(connection.path);
  if (schedule_.now() < way.stalled_until && attempts < kDialAttemptsMax) {
    schedule_.after(kRetryDial,
                    [this, &connection, attempts] { try_to_open(connection, attempts + 1); });
    return;
  }
  if (way.refuses || !server.party->listening() || attempts == kDialAttemptsMax) {
    client.state = EndState::kGone;
    client.party->on_dial_failed(client.id, way.refuses ? "refused" : "no answer");
    return;
  }
  if (way.swaps) {
    client.state = EndState::kGone;
    return client.party->on_dial_failed(client.id, "its certificate is not that of the robot");
  }
  client.state = EndState::kOpen;
  server.state = EndState::kOpen;
  server.id = server.party->accept();
  server.party->on_open(server.id);
  client.party->on_open(client.id);
}

Network::Connection* Network::find(const Party& party, ConnectionId id, std::size_t& end) const {
  // Newest first: what is asked for is nearly always the newest.
  for (auto it = connections_.rbegin(); it != connections_.rend(); ++it) {
    for (end = 0; end < 2; ++end) {
      const End& e = (*it)->ends[end];
      if (e.party == &party && e.id == id && e.state != EndState::kGone) return it->get();
    }
  }
  return nullptr;
}

int Network::path_of(const Party& party, ConnectionId id) const {
  std::size_t end = 0;
  const Connection* connection = find(party, id, end);
  return connection == nullptr ? 0 : connection->path;
}

bool Network::is_alive(const Party& party, ConnectionId id) const {
  std::size_t end = 0;
  const Connection* connection = find(party, id, end);
  return connection != nullptr && !connection->dead;
}

void Network::poke(Party& party, ConnectionId id) {
  std::size_t end = 0;
  Connection* connection = find(party, id, end);
  if (connection != nullptr) pull(*connection, end);
}

void Network::pull(Connection& connection, std::size_t from) {
  End& end = connection.ends[from];
  Pipe& pipe = connection.pipes[from];
  while (end.state == EndState::kOpen && pipe.buffered < path(connection.path).plan.send_buffer) {
    auto packet = end.party->pull(end.id);
    if (!packet) break;
    pipe.buffered += packet->bytes.size();
    pipe.queue.push_back(Item{std::move(*packet), {}});
  }
  send(connection, from);
}

// Puts the first packet of the pipe on the wire. Nothing moves on a dead or stalled connection, so
// that its buffer fills up as a real one would.
void Network::send(Connection& connection, std::size_t from) {
  Pipe& pipe = connection.pipes[from];
  Path& way = path(connection.path);
  if (pipe.sending || pipe.queue.empty() || connection.dead) return;
  if (schedule_.now() < way.stalled_until) return;
  // The relay reads only what it can pass on.
  if (way.plan.has_relay() && pipe.at_relay >= way.plan.relay_buffer) return;
  pipe.sending = true;
  const auto bytes = static_cast<std::int64_t>(pipe.queue.front().packet.bytes.size()) + 6;
  const auto rate = static_cast<std::int64_t>(way.plan.bytes_per_second);
  way.busy_until[from] =
      std::max(schedule_.now(), way.busy_until[from]) + Duration{bytes * 1'000'000'000 / rate};
  schedule_.at(way.busy_until[from], [this, &connection, from] { sent(connection, from); });
}

void Network::sent(Connection& connection, std::size_t from) {
  Pipe& pipe = connection.pipes[from];
  pipe.sending = false;
  if (connection.dead) return;
  Item item = std::move(pipe.queue.front());
  pipe.queue.pop_front();
  pipe.buffered -= item.packet.bytes.size();
  const PathPlan& plan = path(connection.path).plan;
  Duration late = plan.jitter > 0ns ? rng_.between(0ns, plan.jitter) : 0ns;
  if (plan.loss_permille > 0 && rng_.chance(plan.loss_permille)) late += 2 * plan.delay + kRepair;
  pipe.last_arrival = std::max(pipe.last_arrival, schedule_.now() + plan.delay + late);
  auto shared = std::make_shared<Item>(std::move(item));
  if (plan.has_relay()) {
    pipe.at_relay += shared->packet.bytes.size();
    schedule_.at(pipe.last_arrival,
                 [this, &connection, from, shared] { at_relay(connection, from, shared); });
    return pull(connection, from);
  }
  schedule_.at(pipe.last_arrival,
               [this, &connection, from, shared] { arrive(connection, from, std::move(*shared)); });
  pull(connection, from);
}

// It passes on whole packets, one after another.
void Network::at_relay(Connection& connection, std::size_t from,
                       const std::shared_ptr<Item>& item) {
  if (connection.dead) return;
  Pipe& pipe = connection.pipes[from];
  const PathPlan& plan = path(connection.path).plan;
  const std::size_t size = item->packet.bytes.size();
  pipe.relay_busy_until = std::max(schedule_.now(), pipe.relay_busy_until) +
                          Duration{static_cast<std::int64_t>(size + 6) * 1'000'000'000 /
                                   static_cast<std::int64_t>(plan.relay_bytes_per_second)};
  schedule_.at(pipe.relay_busy_until, [this, &connection, from, size] {
    connection.pipes[from].at_relay -= size;
    send(connection, from);
  });
  // None overtakes, also when the leg has become shorter.
  pipe.relay_arrival = std::max(pipe.relay_arrival, pipe.relay_busy_until + plan.relay_delay);
  schedule_.at(pipe.relay_arrival,
               [this, &connection, from, item] { arrive(connection, from, std::move(*item)); });
}

void Network::arrive(Connection& connection, std::size_t from, Item item) {
  if (connection.dead) return;
  End& to = connection.ends[1 - from];
  if (item.close) {
    const Duration back = path(connection.path).plan.one_way();
    end_closed(connection, 1 - from, item.close, 0ns);
    end_closed(connection, from, {}, back);
    return;
  }
  if (to.state == EndState::kOpen) {
    to.party->on_packet(to.id, std::move(item.packet));
  } else if (to.state == EndState::kGone) {  // nobody there: the sender is told by a reset
    end_closed(connection, from, {}, path(connection.path).plan.one_way());
  }
}

void Network::end_closed(Connection& connection, std::size_t end, std::optional<std::uint16_t> code,
                         Duration delay) {
  schedule_.after(delay, [&connection, end, code] {
    End& e = connection.ends[end];
    if (e.state == EndState::kGone) return;
    const bool known = e.state != EndState::kOpening || end == 0;
    e.state = EndState::kGone;
    if (known) e.party->on_closed(e.id, code);
  });
}

void Network::close(Party& party, ConnectionId id, std::uint16_t code) {
  std::size_t from = 0;
  Connection* connection = find(party, id, from);
  if (connection == nullptr || connection->ends[from].state == EndState::kClosing) return;
  const bool open = connection->ends[from].state == EndState::kOpen;
  connection->ends[from].state = EndState::kClosing;
  if (open) {
    connection->pipes[from].queue.push_back(Item{{}, code});
    send(*connection, from);
  }
  end_closed(*connection, from, {}, open ? kCloseTimeout : 1ms);
  // After its own time-out the closing end resets the connection, which reaches the peer or not.
  if (open) {
    schedule_.after(kCloseTimeout, [this, connection, from] {
      if (connection->dead) return;
      if (schedule_.now() < path(connection->path).stalled_until) return;
      end_closed(*connection, 1 - from, {}, path(connection->path).plan.one_way());
    });
  }
}

void Network::died(Party& party, bool peers_notice) {
  for (auto& connection : connections_) {
    for (std::size_t end = 0; end < 2; ++end) {
      End& e = connection->ends[end];
      if (e.party != &party || e.state == EndState::kGone) continue;
      if (end == 1 && e.state == EndState::kOpening) continue;  // it may come back in time
      e.state = EndState::kGone;
      connection->dead = true;
      disturb(connection->path, 0ns);
      if (peers_notice) end_closed(*connection, 1 - end, {}, rng_.between(1us, 20ms));
    }
  }
}

void Network::cut(int path_id, bool client_notices, bool server_notices) {
  disturb(path_id, 0ns);
  for (auto& connection : connections_) {
    if (connection->path != path_id || connection->dead) continue;
    if (connection->ends[0].state == EndState::kOpening) continue;
    connection->dead = true;
    if (client_notices) end_closed(*connection, 0, {}, rng_.between(0ns, 5ms));
    if (server_notices) end_closed(*connection, 1, {}, rng_.between(0ns, 5ms));
  }
}

void Network::stall(int path_id, Duration how_long) {
  Path& way = path(path_id);
  way.stalled_until = std::max(way.stalled_until, schedule_.now() + how_long);
  disturb(path_id, how_long);
  schedule_.at(way.stalled_until, [this, path_id] { wake(path_id); });
}

void Network::end_stall(int path_id) {
  path(path_id).stalled_until = schedule_.now();
  wake(path_id);
}

void Network::wake(int path_id) {
  for (auto& connection : connections_) {
    if (connection->path != path_id || connection->dead) continue;
    send(*connection, 0);
    send(*connection, 1);
  }
}

void Network::change(int path_id, const PathPlan& plan) {
  path(path_id).plan = plan;
  disturb(path_id, 0ns);
}

void Network::disturb(int path_id, Duration how_long) {
  Path& way = path(path_id);
  way.disturbed_until = std::max(way.disturbed_until, schedule_.now() + how_long);
}

bool Network::is_over(const Connection& connection) {
  const EndState server = connection.ends[1].state;
  return connection.ends[0].state == EndState::kGone &&
         (server == EndState::kGone || server == EndState::kOpening);
}

void Network::forget(TimePoint before) {
  for (auto& connection : connections_)
    if (!connection->over_since && is_over(*connection)) connection->over_since = schedule_.now();
  std::erase_if(connections_, [before](const auto& connection) {
    return connection->over_since && *connection->over_since < before;
  });
}

}  // namespace connect_bridge::sim
