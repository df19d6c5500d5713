#include "core/topics/mirror_settling.hpp"

#include <algorithm>

#include "core/graph/settling.hpp"
#include "core/policy/interface.hpp"
#include "core/topics/import_context.hpp"

// The times, all to be over before the mirror feeds: 500 ms since the first picture of the graph
// (kDiscovery); beside another bridge also 250 ms since it was made (kTopicSettle), in which claims
// of the same origin cross; and while a bridge that a peer has named as a neighbour is not heard,
// 3.5 s since that first picture (kNeighbourDiscovery). In this last time nothing is claimed
// (`released_`), so that a bridge that need not wait does not give way; when it ends, the mirror
// claims and takes 250 ms more if anybody may contest that. docs/protocol.md section 14, rules 4
// and 5.
namespace connect_bridge {

void MirrorSettling::begin(MirrorId id, Duration least, const Now& now) {
  id_ = id;
  const TimePoint since = *context_.graph_since;
  TimePoint settled = std::max(now.steady + least, since + kDiscovery);
  if (!context_.graph.bridges().empty()) settled = std::max(settled, now.steady + kTopicSettle);
  waits_for_neighbours_ = context_.claims.misses();
  if (waits_for_neighbours_) settled = std::max(settled, since + kNeighbourDiscovery);
  // A bridge that need not wait must not give way to one that waits.
  released_ = waits_for_neighbours_;
  settle_at(settled, now);
}

void MirrorSettling::end() {
  if (has_action_token(topic_.first)) context_.action_topics.remove(topic_.first, id_);
  id_ = {};
  feeds_ = released_ = waits_for_neighbours_ = false;
  settles_.cancel();
}

void MirrorSettling::again(const Now& now) {
  const TimePoint settled = now.steady + kTopicSettle;
  // It keeps feeds_: the claim stays as it was, or another bridge would take over what only pauses.
  settles_ = context_.timers.set(settles_ ? std::max(settles_.at(), settled) : settled, &mirror_);
}

// The topics of an action stay with its services, and these with their calls.
void MirrorSettling::release(bool silent, const Now& now) {
  const bool released =
      silent && !context_.graph.bridges().empty() && !has_action_token(topic_.first);
  if (!id_ || waits_for_neighbours_ || released == released_) return;
  released_ = released;
  context_.claim_changed = true;
  if (released) {
    // A mirror that has not fed must claim its origin first when the link is back.
    released_at_ = feeds_ ? now.steady : TimePoint::max() - kTopicSettle;
    settles_.cancel();
    return set_feeds(false);
  }
  // Another bridge that has the origin, too, has claimed it by then, if there is one.
  const bool contested = context_.claims.claimed(origin_) || released_at_ > now.steady;
  const TimePoint known = (contested ? now.steady : released_at_) + kTopicSettle;
  settle_at(std::max(known, *context_.graph_since + kDiscovery), now);
}

void MirrorSettling::on_claims(const Now& now) {
  const bool misses = context_.claims.misses();
  // Once it feeds nobody is waited for, whoever is named later (docs/protocol.md section 7, rule
  // 5).
  if (!settles_ || feeds_ || misses == waits_for_neighbours_) return;
  waits_for_neighbours_ = released_ = misses;
  context_.claim_changed = true;
  const TimePoint since = *context_.graph_since;
  if (misses) return settle_at(std::max(settles_.at(), since + kNeighbourDiscovery), now);
  // Nothing was claimed meanwhile. And who was waited for, and started at the same moment, must be
  // heard to feed: two that settle together both feed until their claims have crossed.
  const Duration settle = may_be_contested() ? kTopicSettle : Duration::zero();
  settle_at(std::max(now.steady, since + kDiscovery) + settle, now);
}

bool MirrorSettling::may_be_contested() const {
  return context_.claims.any() || !context_.graph.bridges().empty();
}

bool MirrorSettling::on_time(const Now& now) {
  if (!settles_ || settles_.at() > now.steady) return false;
  if (waits_for_neighbours_ && may_be_contested()) {  // nothing was claimed yet
    waits_for_neighbours_ = released_ = false;
    context_.claim_changed = true;
    settle_at(now.steady + kTopicSettle, now);
    return false;
  }
  settles_.cancel();
  waits_for_neighbours_ = released_ = false;
  if (!feeds_) context_.claim_changed = true;
  set_feeds(true);
  return true;
}

void MirrorSettling::settle_at(TimePoint settled, const Now& now) {
  settles_.cancel();
  // A bridge that waits has claimed nothing, so it does not settle before that is over
  // (on_claims()).
  if (waits_for_neighbours_) settled = std::max(settled, now.steady + kTopicSettle);
  if (settled > now.steady) settles_ = context_.timers.set(settled, &mirror_);
  set_feeds(!settles_);
}

void MirrorSettling::set_feeds(bool feeds) {
  feeds_ = feeds;
  if (has_action_token(topic_.first)) context_.action_topics.set(topic_.first, id_, feeds);
}

}  // namespace connect_bridge
