#include "core/mirrors/mirror_table.hpp"

#include <algorithm>
#include <iterator>

#include "core/mirrors/import_context.hpp"

namespace connect_bridge {
namespace {

// Other bridges hold a publisher for less than this before it counts (LocalGraph).
constexpr Duration kEndedClaimed = std::chrono::seconds(1);
constexpr int kDueAtOnce = 64;

}  // namespace

// ---- finding

TopicMirror* MirrorTable::find(const MirrorKey& key) {
  const auto found = mirrors_.find(key);
  return found == mirrors_.end() ? nullptr : &found->second;
}

TopicMirror* MirrorTable::find(MirrorId id) const {
  const auto found = in_graph_.find(id);
  return found == in_graph_.end() ? nullptr : found->second.mirror;
}

std::vector<TopicMirror*> MirrorTable::of(const Link& link) {
  std::vector<TopicMirror*> found;
  found.reserve(link.mirrors.all());
  for (const auto& [topic, count] : link.mirrors.by_topic())
    for (auto& [key, mirror] : of(topic))
      if (mirror.candidate(link.id)) found.push_back(&mirror);
  return found;
}

// ---- beginning and end

// Earlier offers of the link count until they are forgotten, so reconnecting again and again gives
// no more mirrors.
TopicMirror* MirrorTable::open(const MirrorKey& key, const Link& link) {
  TopicMirror* const known = find(key);
  if (known && known->candidate(link.id)) return known;
  // The narrowest limit comes first: of the link, then of one topic of the link. The last one is
  // the identity's share of the places that all use.
  if (link.mirrors.all() >= context_.options.mirrors_max) return nullptr;  // mutant: mirrors_max
  if (link.mirrors.of(key.first) >= context_.options.topic_mirrors_max) return nullptr;
  if (known) return known;
  if (link.account->places.room() == 0) return nullptr;
  return &mirrors_.try_emplace(key, context_, key).first->second;
}

void MirrorTable::remove_candidate(TopicMirror& mirror, LinkId link, const Now& now) {
  mirror.remove_candidate(link, now);
  if (mirror.is_over()) mirrors_.erase(MirrorKey(mirror.key()));
}

void MirrorTable::on_time(const Now& now) {
  for (int n = 0; n < kDueAtOnce; ++n) {
    const auto due = timers_.take_due(now.steady);
    if (!due) return;
    TopicMirror& mirror = **due;
    const Outputs::Paying paying(context_.outputs, mirror.payer());  // mutant: paid_deadlines
    mirror.on_time(now);
    if (mirror.is_over()) mirrors_.erase(MirrorKey(mirror.key()));
  }
}

// ---- in the graph

void MirrorTable::on_made(MirrorId id, const Gid& gid) {
  const auto found = in_graph_.find(id);
  if (found == in_graph_.end()) return;
  if (found->second.gid == Gid{} && gid != Gid{}) claimed_.insert(gid);
  found->second.gid = gid;
  context_.outputs.follow_up(FollowUp::kClaim);
}

void MirrorTable::note_destroyed(MirrorId id, bool existed) {
  const auto ended = in_graph_.extract(id);
  if (ended.mapped().gid != Gid{}) ended_.push_back(ended.mapped().gid);
  if (existed) leave_name(*ended.mapped().mirror);
}

// A middleware may refuse a second type of a name. A node that was killed and returns with another
// type is heard when the mirror of its former publisher ends.
void MirrorTable::leave_name(const TopicMirror& ended) {
  const auto& [name, type] = ended.key().first;
  std::vector<TopicMirror*> others;
  for (auto& [key, mirror] : named(name)) {
    if (key.first.second != type) {
      others.push_back(&mirror);
    } else if (mirror.id() && &mirror != &ended) {
      return;
    }
  }
  for (TopicMirror* const other : others) other->try_again();  // mutant: other_type_ends
}

bool MirrorTable::has_type(std::string_view type) const {
  return std::any_of(in_graph_.begin(), in_graph_.end(), [&](const auto& one) {
    return one.second.mirror->key().first.second == type;
  });
}

void MirrorTable::add_to(Claim& claim, const Now& now) {
  for (const auto& [key, mirror] : mirrors_)
    if (mirror.is_claimed()) claim.origins.push_back(key.second);
  // Other bridges recognize mirrors by these ids, even under proxy nodes (docs/protocol.md section
  // 14, rule 7). A bridge that has just started may have seen a mirror that has ended.
  for (const Gid& gid : std::exchange(ended_, {})) leaving_.emplace_back(now.steady, gid);
  while (!leaving_.empty() && leaving_.front().first + kEndedClaimed <= now.steady) {
    claimed_.erase(claimed_.find(leaving_.front().second));
    leaving_.pop_front();
  }
  std::unique_copy(claimed_.begin(), claimed_.end(), std::back_inserter(claim.mirrors));
}

}  // namespace connect_bridge
