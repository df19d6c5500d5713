// Endpoints that appear here because of one link's peer. Counts the publishers that stand for its
// origins, the bytes that they may keep, and the endpoints that had to wait.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "core/base/budget.hpp"

namespace connect_bridge {

// Mirrors are counted as they come and go, in all and by topic (local name and type). A search at
// each offered origin would let a peer keep this side busy with few bytes. Single-threaded.
class LinkMirrors {
 public:
  using Topic = std::pair<std::string, std::string>;

  // Mirrors take places of their identity, and their kept samples take the link's memory; both
  // outlive this object.
  LinkMirrors(Budget& places, Budget& memory) : places_(places.hold(0)), latched_(&memory) {}

  // ---- mirrors of origins that the peer offers, or is expected to offer again
  void add(const Topic& topic) {
    places_.resize(all() + 1);
    ++by_topic_[topic];
  }
  // Removes a mirror that was added.
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
  // Bytes that the middleware may keep for mirrors that the link feeds.
  [[nodiscard]] Budget& latched() { return latched_; }

  // One more endpoint has to wait: the peers of its identity make too many appear.
  void note_wait() { ++waited_; }
  [[nodiscard]] std::uint64_t waited() const { return waited_; }

 private:
  Budget::Hold places_;
  Budget latched_;
  std::map<Topic, std::uint32_t> by_topic_;
  std::uint64_t waited_ = 0;
};

}  // namespace connect_bridge
