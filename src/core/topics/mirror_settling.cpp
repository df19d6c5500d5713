#include "core/topics/mirror_settling.hpp"

#include <algorithm>

#include "core/graph/settling.hpp"
#include "core/policy/interface.hpp"
#include "core/topics/import_context.hpp"

namespace connect_bridge {

void MirrorSettling::begin(MirrorId id, Duration least, const Now& now) {
  id_ = id;
  const TimePoint since = *context_.graph_since;
  TimePoint settled = std::max(now.steady + least, since + kDiscovery);
  if (!context_.graph.bridges().empty()) settled = std::max(settled, now.steady + kTopicSettle);
  waits_for_neighbours_ = context_.claims.misses() && settled < since + kNeighbourDiscovery;
  if (waits_for_neighbours_) settled = since + kNeighbourDiscovery;
  // A bridge that need not wait must not give way to one that waits.
  released_ = waits_for_neighbours_;
  if (settled > now.steady) settles_ = context_.timers.set(settled, &mirror_);
  set_feeds(!settles_);
}

void MirrorSettling::end() {
  if (has_action_token(topic_.first)) context_.action_topics.remove(topic_.first, id_);
  id_ = {};
  feeds_ = released_ = false;
  settles_.cancel();
}

void MirrorSettling::again(const Now& now) {
  settles_ = context_.timers.set(now.steady + kTopicSettle, &mirror_);
  waits_for_neighbours_ = false;
}

// The topics of an action stay with its services, and these with their calls.
void MirrorSettling::release(bool silent, const Now& now) {
  const bool released =
      silent && !context_.graph.bridges().empty() && !has_action_token(topic_.first);
  if (!id_ || waits_for_neighbours_ || released == released_) return;
  released_ = released;
  context_.claim_changed = true;
  if (!released) return again(now);
  settles_.cancel();
  set_feeds(false);
}

void MirrorSettling::on_claims(const Now& now) {
  if (!waits_for_neighbours_ || context_.claims.misses()) return;
  waits_for_neighbours_ = released_ = false;
  context_.claim_changed = true;
  const TimePoint settled = std::max(now.steady + kTopicSettle, *context_.graph_since + kDiscovery);
  if (settles_ && settled < settles_.at()) settles_ = context_.timers.set(settled, &mirror_);
}

bool MirrorSettling::on_time(const Now& now) {
  if (!settles_ || settles_.at() > now.steady) return false;
  settles_.cancel();
  waits_for_neighbours_ = released_ = false;
  if (!feeds_) context_.claim_changed = true;
  set_feeds(true);
  return true;
}

void MirrorSettling::set_feeds(bool feeds) {
  feeds_ = feeds;
  if (has_action_token(topic_.first)) context_.action_topics.set(topic_.first, id_, feeds);
}

}  // namespace connect_bridge
