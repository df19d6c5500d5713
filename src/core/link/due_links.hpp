// The links with work to do, the connections with something to send, and the next deadline of each.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <utility>

#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/base/timers.hpp"

namespace connect_bridge {

// A link marks itself when it may have something to do: it has failed, has something to send, or
// its deadline has changed. The owner of the links checks only marked links, so an input for one
// link costs the same with a thousand links. Single-threaded.
class DueLinks {
 public:
  using Timer = Timers<LinkId>::Timer;

  void mark(LinkId link) { marked_.insert(link); }
  // Takes the link that was marked first, with all its marks.
  std::optional<LinkId> take_marked() { return marked_.take(); }

  // The connection has something to send.
  void ready(ConnectionId connection) { ready_.insert(connection); }
  void gone(ConnectionId connection) {
    ready_.erase(connection);
    later_.erase(connection);
  }
  // The connection's packets wait for work of others: it is ready again after the next
  // look_again(). Returns since when it waits.
  TimePoint later(ConnectionId connection, TimePoint now) {
    return later_.try_emplace(connection, now).first->second;
  }
  void not_later(ConnectionId connection) { later_.erase(connection); }
  // Called after each input. `others`: other links still work. Then the waiting connections become
  // ready only once in kLookAgain: an input is short, and this costs more the more connections
  // wait.
  void look_again(bool others, TimePoint now) {
    if (others && now < looked_again_ + kLookAgain) return;
    looked_again_ = now;
    for (const auto& [connection, since] : later_) ready_.insert(connection);
  }
  std::optional<ConnectionId> take_ready() { return ready_.take(); }

  // Sets the timer of a link to its deadline, which may have changed. The timer may not outlive
  // this object.
  void wait(LinkId link, Timer& timer, std::optional<TimePoint> until) {
    if (!until) return timer.cancel();
    if (!timer || timer.at() != *until) timer = timers_.set(*until, link);
  }
  // A link whose time has come. The caller cancels its timer, or sets it again.
  std::optional<LinkId> take_due(TimePoint now) { return timers_.take_due(now); }
  [[nodiscard]] std::optional<TimePoint> deadline() const { return timers_.deadline(); }

 private:
  static constexpr Duration kLookAgain = std::chrono::milliseconds(1);

  // One place is kept for the next id: mostly one link is marked at a time.
  template <class Id>
  class Ids {
   public:
    void insert(Id id) {
      if (!spare_) return void(ids_.insert(id));
      spare_.value() = id;
      spare_ = std::move(ids_.insert(std::move(spare_)).node);
    }
    void erase(Id id) { ids_.erase(id); }
    std::optional<Id> take() {
      if (ids_.empty()) return std::nullopt;
      spare_ = ids_.extract(ids_.begin());
      return spare_.value();
    }

   private:
    std::set<Id> ids_;
    typename std::set<Id>::node_type spare_;
  };

  Ids<LinkId> marked_;
  Ids<ConnectionId> ready_;
  std::map<ConnectionId, TimePoint> later_;
  TimePoint looked_again_{};
  Timers<LinkId> timers_;
};

}  // namespace connect_bridge
