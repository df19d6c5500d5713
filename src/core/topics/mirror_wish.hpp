// What a mirror wants of the topic that feeds it, and how many mirrors want it.
#pragma once

#include <cstddef>
#include <utility>

#include "core/base/time.hpp"

namespace connect_bridge {

class PeerTopic;

struct MirrorWish {
  PeerTopic* feeder = nullptr;
  bool ready = false;    // it wants data if its topic has a subscriber here
  bool expects = false;  // it wants data without one, too
  bool keeps = false;    // it keeps samples for late subscribers

  bool operator==(const MirrorWish&) const = default;
};

// Of all mirrors that a topic feeds. Each says when its wish changes: to ask all of them whenever
// one has changed would cost links x publishers x publishers when a link is lost.
class MirrorWishes {
 public:
  void add(const MirrorWish& wish) {
    ready_ += wish.ready;
    expecting_ += wish.expects;
  }
  void remove(const MirrorWish& wish) {
    ready_ -= wish.ready;
    expecting_ -= wish.expects;
  }
  // Whether one of them wants data. `listened`: the topic has a subscriber here.
  [[nodiscard]] bool any(bool listened) const { return (listened ? ready_ : expecting_) > 0; }

 private:
  std::size_t ready_ = 0;
  std::size_t expecting_ = 0;
};

// The wish of one mirror, as its feeder counts it.
class CountedWish {
 public:
  // The feeder that counted it before.
  PeerTopic* change(const MirrorWish& wish);
  // The same, and both feeders judge their demand.
  void settle(const MirrorWish& wish, const Now& now);
  // The topic ends, or offers the mirror's origin no longer.
  void forget(const PeerTopic* feeder);

 private:
  MirrorWish wish_;
};

}  // namespace connect_bridge
