// The order in which packets are read.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/ports/payer.hpp"

namespace connect_bridge {

// Connections whose packets wait to be read, in a queue for each identity. The identity that has
// used least of the loop's time lately comes first, with one packet of one connection. So an
// identity that uses little waits for at most one step of the others, however many connections or
// identities they have. A packet waits only for packets of others. A packet that has waited for
// `patience` comes before those of identities that have used more. The cost hardly grows with the
// number of waiting packets. Single-threaded.
class LoopTurns {
 public:
  explicit LoopTurns(Duration patience) : patience_(patience) {}

  // A packet of this connection waits. No other packet of the connection waits here.
  void wait(ConnectionId connection, const Payer& payer, TimePoint now) {
    Line& line = lines_[payer.get()];
    line.waiting.push_back({connection, now});
    if (line.waiting.size() > 1) return;
    line.payer = payer;
    line.number = ++last_;
    line.rank = payer->rank();
    add(line);
  }
  // The connection is gone.
  void forget(ConnectionId connection) {
    for (auto it = lines_.begin(); it != lines_.end();) {
      Line& line = (it++)->second;
      remove(line);
      std::erase_if(line.waiting, [&](const Waiting& w) { return w.connection == connection; });
      add_or_end(line);
    }
  }
  // The connection whose packet is read now; the packet waits no longer. nullopt: there is none.
  std::optional<ConnectionId> take(TimePoint now) {
    if (lines_.empty()) return std::nullopt;
    Line& oldest = *by_time_.begin()->second;
    const bool late = oldest.waiting.front().since + patience_ <= now;
    late_is_next_ = late && !late_is_next_;  // mutant: turns_of_late
    Line& next = late_is_next_ ? oldest : least_used();
    remove(next);
    const ConnectionId connection = next.waiting.front().connection;
    next.waiting.pop_front();
    add_or_end(next);
    return connection;
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
  [[nodiscard]] bool empty() const { return lines_.empty(); }

 private:
  struct Waiting {
    ConnectionId connection;
    TimePoint since;
  };
  struct Line {
    Payer payer;
    std::uint64_t number = 0;       // the first that came, among equals
    double rank = 0;                // of the payer, when last seen: it only grows
    std::deque<Waiting> waiting{};  // never empty
  };

  void add(Line& line) {
    by_rank_[{line.rank, line.number}] = &line;
    by_time_[{line.waiting.front().since, line.number}] = &line;
  }
  void remove(Line& line) {
    by_rank_.erase({line.rank, line.number});
    by_time_.erase({line.waiting.front().since, line.number});
  }
  void add_or_end(Line& line) {
    if (line.waiting.empty()) {
      lines_.erase(line.payer.get());
    } else {
      add(line);
    }
  }
  [[nodiscard]] Line& least_used() {
    for (;;) {
      Line& line = *by_rank_.begin()->second;
      const double rank = line.payer->rank();
      if (rank <= line.rank) return line;
      by_rank_.erase(by_rank_.begin());
      line.rank = rank;
      by_rank_[{rank, line.number}] = &line;
    }
  }

  const Duration patience_;
  std::unordered_map<const LoopTime*, Line> lines_;
  std::map<std::pair<double, std::uint64_t>, Line*> by_rank_;
  std::map<std::pair<TimePoint, std::uint64_t>, Line*> by_time_;
  std::uint64_t last_ = 0;
  bool late_is_next_ = false;  // the last turn was that of a packet that had waited
};

}  // namespace connect_bridge
