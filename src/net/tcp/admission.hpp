// How many connections may be open, and how many of them may be without a login.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace connect_bridge {

// A place is given back when its last owner releases it, also after the Admission is destroyed.
// When no place is left, a connection without a login is closed: of the address that has most of
// them, the oldest of whom nothing was read, or the oldest, as a real client logs in within a round
// trip. Single-threaded.
class Admission {
 public:
  // The place of a connection without a login.
  struct Pending {
    std::function<void()> give_way;  // closes the connection; set by its owner
    bool open = false;               // a WebSocket: it has a place among the open ones, too
    bool silent = true;              // nothing was read of it
  };

  // Which limit made a connection give way.
  enum class Limit : std::uint8_t { kConnections, kPending, kPendingOfAddress };
  struct Options {
    std::size_t connections_max = 0;
    std::size_t pending_max = 0;
    std::size_t pending_per_address_max = 0;
    std::function<void(Limit)> gave_way;  // may be empty; called after each
  };

  explicit Admission(Options options)
      : state_(std::make_shared<State>()), options_(std::move(options)) {}

  // A place for an open WebSocket; null when connections with a login have all of them.
  std::shared_ptr<void> take_connection() {
    if (state_->connections >= options_.connections_max)
      give_way(Limit::kConnections, [](const Entry& entry) { return entry.place->open; });
    if (state_->connections >= options_.connections_max) return nullptr;
    ++state_->connections;
    return {state_.get(), [state = state_](void*) { --state->connections; }};
  }

  // A place for a connection without a login. `share`: how many times the usual number its address
  // may have; 0: any number, until the proxy has said for which client it connects.
  std::shared_ptr<Pending> take_pending(const std::string& address, int share = 1) {
    make_room(address, share);  // mutant: strangers_of_address
    if (state_->pending.size() >= options_.pending_max)
      give_way(Limit::kPending, [busiest = busiest()](const Entry& entry) {
        return entry.address == busiest;  // mutant: turns_of_strangers
      });
    const std::uint64_t number = ++state_->last;
    auto* place = new Pending;
    state_->pending[number] = {address, place};
    return {place, [state = state_, number](Pending* gone) {
              state->pending.erase(number);
              delete gone;
            }};
  }

  // The proxy has given the client's address: the connection counts there from now on.
  void move_pending(const Pending& place, const std::string& address, int share) {
    for (auto& [number, entry] : state_->pending) {
      if (entry.place != &place) continue;
      entry.address.clear();
      make_room(address, share);
      entry.address = address;
      return;
    }
  }

 private:
  struct Entry {
    std::string address;
    Pending* place = nullptr;
  };
  struct State {
    std::size_t connections = 0;
    std::uint64_t last = 0;
    std::map<std::uint64_t, Entry> pending;  // the oldest first
  };

  // The address with most of them; of several the one with the oldest.
  [[nodiscard]] std::string busiest() const {
    std::unordered_map<std::string_view, std::size_t> counts;
    for (const auto& [number, entry] : state_->pending) ++counts[entry.address];
    const std::string* found = nullptr;
    std::size_t most = 0;
    for (const auto& [number, entry] : state_->pending) {
      if (counts[entry.address] <= most) continue;
      most = counts[entry.address];
      found = &entry.address;
    }
    return found ? *found : "";
  }

  void make_room(const std::string& address, int share) {
    if (share == 0) return;
    std::size_t of_address = 0;
    for (const auto& [number, entry] : state_->pending) of_address += entry.address == address;
    if (of_address >= static_cast<std::size_t>(share) * options_.pending_per_address_max)
      give_way(Limit::kPendingOfAddress,
               [&](const Entry& entry) { return entry.address == address; });
  }

  // The oldest one that `may` gives way: of the silent ones, while these are half of all or more.
  // Else a few that stall after their first byte would leave one place to all newcomers.
  template <class May>
  void give_way(Limit limit, May may) {
    const auto none = state_->pending.end();
    auto oldest = none, silent = none;
    std::size_t all = 0, silent_ones = 0;
    for (auto it = state_->pending.begin(); it != none; ++it) {
      if (!may(it->second)) continue;
      ++all;
      if (oldest == none) oldest = it;
      if (!it->second.place->silent) continue;
      ++silent_ones;
      if (silent == none) silent = it;
    }
    const auto found = silent != none && 2 * silent_ones >= all ? silent : oldest;
    if (found == none) return;
    const auto close = std::move(found->second.place->give_way);
    state_->pending.erase(found);
    if (close) close();
    if (options_.gave_way) options_.gave_way(limit);
  }

  std::shared_ptr<State> state_;
  Options options_;
};

}  // namespace connect_bridge
