#include "core/topics/origins.hpp"

#include <algorithm>

#include "core/wire/control.hpp"

namespace connect_bridge {
namespace {

constexpr Duration kOriginLinger = std::chrono::milliseconds(300);
constexpr Duration kOriginLingerMax = std::chrono::seconds(3);  // while its samples wait in a queue

}  // namespace

std::vector<Gid> Origins::update(const TopicState* state, const Now& now) {
  static const std::vector<Endpoint> kNobody;
  const std::uint64_t before = last_change_;
  for (const auto& publisher : state ? state->publishers : kNobody) {
    if (origins_.size() >= kChannelOriginsMax && !origins_.contains(publisher.gid))
      continue;  // a peer would refuse the channel (docs/protocol.md, "Limits")
    auto [it, is_new] = origins_.try_emplace(publisher.gid);
    Origin& origin = it->second;
    if (is_new) {
      origin.id = {++last_};
      origin.qos = publisher.qos;
    }
    // The graph may know an endpoint before the name of its node.
    const bool named = origin.node.empty() && !node_of(publisher).empty();
    if (named) origin.node = node_of(publisher);
    // The name of a node is sent later as another `added` of the same number (docs/protocol.md,
    // "origins", rule 2).
    if (is_new || named) {
      changes_.erase(origin.change);
      origin.change = ++last_change_;
      changes_.emplace(origin.change, publisher.gid);
    }
    origin.vanishes.cancel();
    origin.lingering = false;
    origin.seen = true;
  }
  for (auto& [gid, origin] : origins_) {
    if (!origin.seen && !origin.vanishes) origin.vanishes = timers_.set(now.steady + kOriginLinger);
    origin.seen = false;
  }
  return changed_since(before);
}

std::vector<Gid> Origins::changed_since(std::uint64_t known) const {
  std::vector<Gid> changed;
  for (auto at = changes_.upper_bound(known); at != changes_.end(); ++at)
    changed.push_back(at->second);
  return changed;
}

std::vector<OriginId> Origins::remove_vanished(bool drained,
                                               const std::function<bool(OriginId)>& is_kept,
                                               const Now& now) {
  // A sample that is kept for a lost link holds its origin until the link's own time limit. A
  // sample in a queue holds it once for kOriginLingerMax: a peer that takes nothing must not keep
  // an origin for ever.
  std::vector<OriginId> removed;
  for (auto it = origins_.begin(); it != origins_.end();) {
    Origin& origin = it->second;
    if (!origin.vanishes || origin.vanishes.at() > now.steady) {
      ++it;
    } else if (is_kept(origin.id)) {
      origin.vanishes = timers_.set(now.steady + kOriginLinger);
      ++it;
    } else if (!drained && !origin.lingering) {
      origin.lingering = true;
      origin.vanishes = timers_.set(now.steady + kOriginLingerMax);
      ++it;
    } else {
      removed.push_back(origin.id);
      changes_.erase(origin.change);
      it = origins_.erase(it);
    }
  }
  return removed;
}

void Origins::forget_samples() {
  for (auto& [gid, origin] : origins_) origin.last_number = origin.kept = 0;
}

Origin* Origins::find(const Gid& gid, Durability subscribed) {
  if (gid != Gid{} || origins_.size() < 2 || subscribed == Durability::kVolatile) {
    const auto it = gid == Gid{} ? origins_.begin() : origins_.find(gid);
    return it == origins_.end() ? nullptr : &it->second;
  }
  // Most middlewares do not report the depth of others' publishers: then each gets one sample in
  // turn.
  const auto share = [](const Origin& origin) {
    return std::max<std::uint64_t>(1, origin.qos.depth);
  };
  std::uint64_t all = 0;
  for (const auto& [id, origin] : origins_) all += share(origin);
  // The samples of one turn go to the origins in their order, to each as many as it keeps.
  std::uint64_t turn = turns_++ % all;
  auto it = origins_.begin();
  for (; turn >= share(it->second); ++it) turn -= share(it->second);
  return &it->second;
}

void Origins::number(MessageTaken& taken) const {
  if (taken.origin == Gid{} && origins_.size() > 1) {
    taken.number = 0;
  } else if (taken.number == 0) {
    taken.number = static_cast<std::uint64_t>(taken.stamp);
  }
}

bool Origins::was_kept(Origin& origin, std::uint64_t depth) {
  if (origin.kept >= depth) return false;
  ++origin.kept;
  return true;
}

bool Origins::is_new(Origin& origin, const MessageTaken& taken) {
  if (taken.number == 0) return true;
  if (taken.number <= origin.last_number) return false;
  origin.last_number = taken.number;
  return true;
}

}  // namespace connect_bridge
