// What appears here because of one link's peer: how many publishers stand for its origins, what
// they may keep, and how much had to wait.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "core/base/budget.hpp"

namespace connect_bridge {

// Mirrors are counted as they come and go, in all and by topic (local name and type): to search for
// them at each origin that a peer offers would let it keep this side busy with few bytes.
// Single-threaded.
class LinkMirrors {
 public:
  using Topic = std::pair<std::string, std::string>;

  // They take places of their identity's, and what they keep is of the link's memory; both outlive
  // this.
  LinkMirrors(Budget& places, Budget& memory) : places_(places.hold(0)), latched_(&memory) {}

  // ---- of origins that the peer offers, or is expected to offer again
  void add(const Topic& topic) {
    places_.resize(all() + 1);
    ++by_topic_[topic];
  }
  // One that was added.
  void remove(const Topic& topic) {
    places_.resize(all() - 1);
    const auto counted = by_topic_.find(topic);
    if (--counted->second == 0) by_topic_.erase(counted);
  }
  [[nodiscard]] std::uint64_t all() const { return places_.amount(); }
  [[nodiscard]] std::uint32_t of(const Topic& topic) const {
    const auto counted = by_topic_.find(topic);
    return counted == by_topic_.end() ? 0 : counted->second;
  }
  [[nodiscard]] const std::map<Topic, std::uint32_t>& by_topic() const { return by_topic_; }
  // What the middleware may keep, in bytes, for those that the link feeds.
  [[nodiscard]] Budget& latched() { return latched_; }

  // ---- publishers, services and subscriptions
  // One more has to wait: the peers of its identity make too many appear.
  void note_wait() { ++waited_; }
  [[nodiscard]] std::uint64_t waited() const { return waited_; }

 private:
  Budget::Hold places_;
  Budget latched_;
  std::map<Topic, std::uint32_t> by_topic_;
  std::uint64_t waited_ = 0;
};

}  // namespace connect_bridge
