// How many publishers here stand for origins of one link.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "core/base/budget.hpp"

namespace connect_bridge {

// Counted as they come and go, in all and by topic (local name and type): to search for them at
// each origin that a peer offers would let it keep this side busy with few bytes.
class MirrorCount {
 public:
  using Topic = std::pair<std::string, std::string>;

  // They take places of their identity's, which outlive this.
  explicit MirrorCount(Budget& places) : places_(places.hold(0)) {}

  void add(const Topic& topic) {
    places_.resize(++all_);
    ++by_topic_[topic];
  }
  // One that was added.
  void remove(const Topic& topic) {
    places_.resize(--all_);
    const auto counted = by_topic_.find(topic);
    if (--counted->second == 0) by_topic_.erase(counted);
  }
  [[nodiscard]] std::uint32_t all() const { return all_; }
  [[nodiscard]] std::uint32_t of(const Topic& topic) const {
    const auto counted = by_topic_.find(topic);
    return counted == by_topic_.end() ? 0 : counted->second;
  }

 private:
  std::uint32_t all_ = 0;
  Budget::Hold places_;
  std::map<Topic, std::uint32_t> by_topic_;
};

}  // namespace connect_bridge
