// The order in which packets are handled.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/payer.hpp"

namespace connect_bridge {

// Packets that wait to be handled, in a queue for each identity. The identity that has used least
// of the loop's time lately comes first, with one packet of one connection. So an identity that
// uses little waits for at most one step of the others, however many connections or identities they
// have. A packet waits only for packets of others. A packet that has waited for `patience` comes
// before those of identities that have used more. The cost hardly grows with the number of waiting
// packets. Single-threaded.
class LoopTurns {
 public:
  explicit LoopTurns(Duration patience) : patience_(patience) {}

  // The packet waits. No other packet of its connection waits here.
  void wait(PacketReceived packet, const Payer& payer, TimePoint now) {
    Line& line = line_of(payer);
    line.waiting.push_back({std::move(packet), now});
    if (line.waiting.size() > 1) return;
    line.number = ++last_;
    line.rank = payer->rank();
    add(line);
  }
  // The connection is gone.
  void forget(ConnectionId connection) {
    for (auto it = by_rank_.begin(); it != by_rank_.end();) {
      Line& line = *(it++)->second;
      remove(line);
      std::erase_if(line.waiting,
                    [&](const Waiting& w) { return w.packet.connection == connection; });
      if (!line.waiting.empty()) add(line);
    }
  }
  // The packet that is handled now. nullopt: there is none.
  std::optional<PacketReceived> take(TimePoint now) {
    if (empty()) return std::nullopt;
    Line& oldest = *by_time_.begin()->second;
    const bool late = oldest.waiting.front().since + patience_ <= now;
    late_is_next_ = late && !late_is_next_;  // mutant: turns_of_late
    Line& next = late_is_next_ ? oldest : least_used();
    remove(next);
    PacketReceived packet = std::move(next.waiting.front().packet);
    next.waiting.pop_front();
    if (!next.waiting.empty()) add(next);
    return packet;
  }
  // Should work of `other`, waiting since `since`, yield to packets of identities that have used
  // less loop time?
  [[nodiscard]] bool come_before(const LoopTime& other, TimePoint since, TimePoint now) const {
    if (since + patience_ <= now) return false;
    const double rank = other.rank();
    for (const auto& [seen, line] : by_rank_) {
      if (seen.first >= rank) break;
      if (line->payer->rank() < rank) return true;
    }
    return false;
  }
  [[nodiscard]] bool empty() const { return by_rank_.empty(); }

 private:
  struct Waiting {
    PacketReceived packet;
    TimePoint since;
  };
  static constexpr std::size_t kIdleMax = 256;  // lines in which nothing waits

  struct Line;
  template <class Key>
  using Order = std::map<std::pair<Key, std::uint64_t>, Line*>;
  struct Line {
    Payer payer;
    std::uint64_t number = 0;  // the first that came, among equals
    double rank = 0;           // of the payer, when last seen: it only grows
    std::deque<Waiting> waiting{};
    // The places in both orders, while nothing waits.
    Order<double>::node_type at_rank{};
    Order<TimePoint>::node_type at_time{};
  };

  // A line is kept when nothing waits in it: it has memory for the next packet.
  Line& line_of(const Payer& payer) {
    if (const auto found = lines_.find(payer.get()); found != lines_.end()) return found->second;
    if (lines_.size() >= by_rank_.size() + kIdleMax)
      std::erase_if(lines_, [](const auto& entry) { return entry.second.waiting.empty(); });
    return lines_.try_emplace(payer.get(), Line{payer}).first->second;
  }
  void add(Line& line) {
    add(by_rank_, line.at_rank, {line.rank, line.number}, line);
    add(by_time_, line.at_time, {line.waiting.front().since, line.number}, line);
  }
  template <class Order>
  static void add(Order& order, typename Order::node_type& place, typename Order::key_type key,
                  Line& line) {
    if (!place) return void(order.emplace(key, &line));
    place.key() = key;
    order.insert(std::move(place));
  }
  void remove(Line& line) {
    line.at_rank = by_rank_.extract({line.rank, line.number});
    line.at_time = by_time_.extract({line.waiting.front().since, line.number});
  }
  [[nodiscard]] Line& least_used() {
    for (;;) {
      Line& line = *by_rank_.begin()->second;
      const double rank = line.payer->rank();
      if (rank <= line.rank) return line;
      line.at_rank = by_rank_.extract(by_rank_.begin());
      line.rank = rank;
      add(by_rank_, line.at_rank, {rank, line.number}, line);
    }
  }

  const Duration patience_;
  std::unordered_map<const LoopTime*, Line> lines_;
  Order<double> by_rank_;  // lines in which something waits
  Order<TimePoint> by_time_;
  std::uint64_t last_ = 0;
  bool late_is_next_ = false;  // the last turn was that of a packet that had waited
};

}  // namespace connect_bridge
