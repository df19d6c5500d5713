// That every channel has its turn.
#include <algorithm>

#include "sim/host.hpp"
#include "sim/wire_check.hpp"

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

// What the link carries in half a second counts of a message at a time, 16 to 512 KiB
// (docs/flow.md, section 4); 512 KiB while the side does not know what it carries.
std::uint64_t turn_bytes(double known_rate, std::uint64_t path_rate) {
  constexpr double kLeast = 16 << 10;
  constexpr double kMost = 512 << 10;
  const double rate = std::max(known_rate, static_cast<double>(path_rate));
  return static_cast<std::uint64_t>(known_rate > 0 ? std::clamp(rate / 2, kLeast, kMost) : kMost);
}

std::uint64_t weight_of(Priority priority) {
  return priority == Priority::kHigh ? 8 : priority == Priority::kNormal ? 4 : 1;
}

}  // namespace

void WireCheck::begin_wait(Connection& connection, Channel& channel) const {
  channel.progress_at = connection.weighted_bytes;
  channel.class_at = connection.class_bytes[channel.priority];
  channel.progress_time = ledger_.now();
  channel.turn_most = connection.turn;
}

// A message that waits keeps the place that it got by the turn of that time, which is much longer
// while the side does not know what the link carries.
void WireCheck::note_turn(Connection& connection, std::uint64_t turn) const {
  constexpr Duration kPlaceKept = 10s;
  if (turn < connection.turn && ledger_.now() - connection.turn_at <= kPlaceKept) return;
  connection.turn = turn;
  connection.turn_at = ledger_.now();
}

// A topic with queued messages must get its turn, by the rule of docs/flow.md, section 4. In its
// class the message goes next that would be complete first: where ours begins, no other channel is
// more than a turn behind it, and none goes on when it is more than a turn before it; so each sends
// at most two turns, and the part that it has begun. Its class has its weight of 13, give or take
// two parts. Light messages, a tenth of the link, leave before all these.
void WireCheck::check_turn(const Host& host, const Connection& connection,
                           const Channel& channel) const {
  const Duration waited = ledger_.now() - channel.progress_time;
  if (waited <= 2s) return;
  const auto& outbox = host.plan().options.outbox;
  const std::uint64_t part = outbox.fragment_bytes + outbox.packet_bytes + kMessageHeaderBytes;
  const double path = static_cast<double>(network_.path(connection.path).plan.rate());
  const auto light =
      static_cast<std::uint64_t>(std::max(10'000.0, path / 10) * (seconds(waited) + 1));
  std::uint64_t others = 0;
  for (const auto& [id, other] : connection.channels)
    others += &other != &channel && other.priority == channel.priority ? 1 : 0;
  const auto judge = [&](const char* who, std::uint64_t sent, std::uint64_t most) {
    if (sent > most)
      violated(channel.wire + " starves at " + describe(host) + ": nothing sent while " + who +
               " sent " + std::to_string(sent) + " bytes, more than " + std::to_string(most));
  };
  const auto of_class = connection.class_bytes.find(channel.priority);
  const std::uint64_t class_sent =
      of_class == connection.class_bytes.end() ? 0 : of_class->second - channel.class_at;
  judge("others of its class", class_sent, others * (2 * channel.turn_most + part) + part + light);
  judge("all classes", connection.weighted_bytes - channel.progress_at,
        (class_sent + 2 * part) * 13 / weight_of(channel.priority) + light);
}

void WireCheck::on_status(const Host& host, const Status& status) {
  for (auto& [key, connection] : connections_) {
    if (key.first != host.index()) continue;
    // With several links the topic's queue cannot be told apart; then nobody is blamed.
    const bool alone = status.links.size() == 1;
    if (alone)
      note_turn(connection,
                turn_bytes(status.links[0].rate, network_.path(connection.path).plan.rate()));
    for (auto& [id, channel] : connection.channels) {
      std::uint64_t queued = 0;
      if (alone && channel.demanded) {
        for (const auto& topic : status.links[0].topics) {
          if (topic.exported && topic.topic == channel.local && topic.type == channel.type) {
            queued = topic.queued;
          }
        }
      }
      if (queued == 0) channel.waits = false;
      if (queued > 0) ledger_.coverage().count(Judged::kTurns);
      if (queued > 0 && !channel.waits) {
        channel.waits = true;
        begin_wait(connection, channel);
      }
      channel.turn_most = std::max(channel.turn_most, connection.turn);
      if (channel.waits) check_turn(host, connection, channel);
    }
  }
}

}  // namespace connect_bridge::sim
