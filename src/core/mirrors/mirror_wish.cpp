#include "core/mirrors/mirror_wish.hpp"

#include "core/mirrors/peer_topic.hpp"

namespace connect_bridge {

PeerTopic* CountedWish::change(const MirrorWish& wish) {
  const MirrorWish before = std::exchange(wish_, wish);
  if (wish == before) return before.feeder;
  if (before.feeder) before.feeder->wishes().remove(before);
  if (wish.feeder) wish.feeder->wishes().add(wish);
  if (wish.feeder && wish.keeps) wish.feeder->note_kept();
  return before.feeder;
}

void CountedWish::settle(const MirrorWish& wish, const Now& now) {
  PeerTopic* const before = change(wish);
  if (before && before != wish.feeder) before->update_demand(now);
  if (wish.feeder) wish.feeder->update_demand(now);
}

void CountedWish::forget(const PeerTopic* feeder) {
  if (feeder && wish_.feeder == feeder) wish_.feeder->wishes().remove(std::exchange(wish_, {}));
}

}  // namespace connect_bridge
