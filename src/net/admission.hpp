// How many may be connected, and how many of one address before they have logged in. A slot is
// given back when its last owner lets go of it, also after the Admission is gone.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <unordered_map>

namespace connect_bridge {

class Admission {
 public:
  Admission(std::size_t connections_max, std::size_t pending_per_address_max)
      : state_(std::make_shared<State>()),
        connections_max_(connections_max),
        pending_per_address_max_(pending_per_address_max) {}

  // A place for an open WebSocket; null when all are taken.
  std::shared_ptr<void> take_connection() {
    if (state_->connections >= connections_max_) return nullptr;
    ++state_->connections;
    return {state_.get(), [state = state_](void*) { --state->connections; }};
  }

  // A place for a connection without a login; null when this address, or all together, have enough.
  std::shared_ptr<void> take_pending(const std::string& address) {
    if (state_->pending >= connections_max_ + kPendingSpare) return nullptr;
    std::size_t& count = state_->by_address[address];
    if (count >= pending_per_address_max_) return nullptr;
    ++count;
    ++state_->pending;
    return {state_.get(), [state = state_, address](void*) {
              --state->pending;
              const auto found = state->by_address.find(address);
              if (--found->second == 0) state->by_address.erase(found);
            }};
  }

 private:
  // Handshakes beyond those that could end in a connection: refusals in progress.
  static constexpr std::size_t kPendingSpare = 64;

  struct State {
    std::size_t connections = 0;
    std::size_t pending = 0;
    std::unordered_map<std::string, std::size_t> by_address;
  };

  std::shared_ptr<State> state_;
  std::size_t connections_max_;
  std::size_t pending_per_address_max_;
};

}  // namespace connect_bridge
