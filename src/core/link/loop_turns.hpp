// Whose packet is read next.
#pragma once

#include <algorithm>
#include <deque>
#include <list>
#include <optional>
#include <utility>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/ports/payer.hpp"

namespace connect_bridge {

// Connections whose packets wait to be read, in a queue for each identity. The identity that has
// used least of the loop's time lately comes first, with one packet of one connection. So an
// identity that uses little waits for at most one step of the others, however many connections or
// identities they have. Nobody waits if nobody else has packets. A packet that has waited for
// `patience` comes before those of identities that have used more. Each choice looks at all queues.
// Single-threaded.
class LoopTurns {
 public:
  explicit LoopTurns(Duration patience) : patience_(patience) {}

  // A packet of this connection, which has no other one here, waits.
  void wait(ConnectionId connection, const Payer& payer, TimePoint now) {
    auto line = std::find_if(lines_.begin(), lines_.end(),
                             [&](const Line& other) { return other.payer == payer; });
    if (line == lines_.end()) line = lines_.insert(lines_.end(), Line{payer, {}});
    line->waiting.push_back({connection, now});
  }
  // It is gone.
  void forget(ConnectionId connection) {
    for (Line& line : lines_)
      std::erase_if(line.waiting, [&](const Waiting& w) { return w.connection == connection; });
    std::erase_if(lines_, [](const Line& line) { return line.waiting.empty(); });
  }
  // Whose packet is read now; it does not wait any more. nullopt: there is none.
  std::optional<ConnectionId> take(TimePoint now) {
    if (lines_.empty()) return std::nullopt;
    const auto oldest = first_by([](const Line& line) { return line.waiting.front().since; });
    const bool late = oldest->waiting.front().since + patience_ <= now;
    late_is_next_ = late && !late_is_next_;  // mutant: turns_of_late
    const auto next =
        late_is_next_ ? oldest : first_by([&](const Line& line) { return line.payer->used(now); });
    const ConnectionId connection = next->waiting.front().connection;
    next->waiting.pop_front();
    if (next->waiting.empty()) lines_.erase(next);
    return connection;
  }
  [[nodiscard]] bool empty() const { return lines_.empty(); }

 private:
  struct Waiting {
    ConnectionId connection;
    TimePoint since;
  };
  struct Line {
    Payer payer;
    std::deque<Waiting> waiting;  // never empty
  };
  using Lines = std::list<Line>;

  template <class Value>
  [[nodiscard]] Lines::iterator first_by(Value value) {
    return std::min_element(lines_.begin(), lines_.end(),
                            [&](const Line& a, const Line& b) { return value(a) < value(b); });
  }

  const Duration patience_;
  Lines lines_;
  bool late_is_next_ = false;  // the last turn was that of one who had waited
};

}  // namespace connect_bridge
