// The data that a mirror wants from the topic that feeds it, and the number of mirrors that want
// it.
#pragma once

#include <cstddef>
#include <utility>

#include "core/base/time.hpp"

namespace connect_bridge {

class PeerTopic;

struct MirrorWish {
  PeerTopic* feeder = nullptr;
  bool ready = false;    // wants data if its topic has a subscriber here
  bool expects = false;  // wants data without a subscriber, too
  bool keeps = false;    // keeps samples for late subscribers

  bool operator==(const MirrorWish&) const = default;
};

// The wishes of all mirrors that a topic feeds. Each mirror reports a change of its wish. Asking
// all mirrors instead would cost links x publishers x publishers when a link is lost.
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
  // Changes the wish. Returns the feeder that counted the wish before.
  PeerTopic* change(const MirrorWish& wish);
  // Changes the wish, and both feeders judge their demand.
  void settle(const MirrorWish& wish, const Now& now);
  // The topic ends, or offers the mirror's origin no longer.
  void forget(const PeerTopic* feeder);

 private:
  MirrorWish wish_;
};

}  // namespace connect_bridge
