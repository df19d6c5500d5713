// The life of mirrors: one per origin, as long as somebody offers it and nobody else has it.
#include <algorithm>

#include "core/link/options.hpp"
#include "core/policy/interface.hpp"
#include "core/topics/imports.hpp"

namespace connect_bridge {
namespace {

// A mirror whose origin is gone stays this long, so that the middleware delivers its last samples.
constexpr Duration kLinger = std::chrono::milliseconds(200);
// Before a mirror asks for data, other bridges of this graph have this long to say that they mirror
// the same origin.
constexpr Duration kSettle = std::chrono::milliseconds(250);
// After a start the local graph is still being discovered.
constexpr Duration kDiscovery = std::chrono::milliseconds(500);
// By then the graph has told of the subscriptions of an action's client.
constexpr Duration kGoalDemand = std::chrono::seconds(5);
// A peer cannot make a mirror keep more samples than this.
constexpr std::uint32_t kDepthMax = 10'000;

}  // namespace

// A mirror that shall belong to its origin's node is made anew when that has a name at last.
void Imports::name_origin(Mirror& mirror, const std::string& node, const Now& now) {
  if (node.empty() || !mirror.origin.node.empty()) return;
  mirror.origin.node = node;
  if (!options_.proxy_nodes || !mirror.id) return;
  destroy(mirror);
  update_mirror(mirror, now);
}

void Imports::add_origin(const ChannelKey& key, Channel& channel, const OriginOffer& origin,
                         const Now& now) {
  if (!origin.origin) return;
  const auto known = channel.origins.find(origin.origin);
  if (known != channel.origins.end()) return name_origin(*known->second, origin.node, now);
  if (channel.key.second == kParameterEventType &&
      is_withheld(links_.at(key.first), channel, origin))
    return;
  const MirrorKey mirror_key{channel.key, origin.gid};
  if (mirrors_.size() >= options_.mirrors_max && !mirrors_.contains(mirror_key)) {
    if (!std::exchange(channel.limited, true)) {
      outputs_.log(LogLevel::kWarn, "no more mirrors than " + std::to_string(options_.mirrors_max) +
                                        ": not all publishers of " + channel.key.first +
                                        " exist here");
    }
    return;
  }
  Mirror& mirror = mirrors_[mirror_key];
  mirror.key = mirror_key;
  const auto own = std::find_if(mirror.candidates.begin(), mirror.candidates.end(),
                                [&](const Candidate& c) { return c.link == key.first; });
  if (own != mirror.candidates.end() && own->channel) return;  // the peer offers one origin twice
  if (own != mirror.candidates.end()) {
    own->channel = key.second;
  } else {
    mirror.candidates.push_back({key.first, key.second});
  }
  mirror.ends_at.reset();
  mirror.failed = false;
  // Another link may have told the node's name already.
  const std::string node = origin.node.empty() ? mirror.origin.node : origin.node;
  const bool moved = options_.proxy_nodes && mirror.origin.node != node;
  mirror.origin = origin;
  mirror.origin.node = node;
  mirror.type_hash = channel.type_hash;
  mirror.action_type = channel.action_type;
  const Qos qos = mirror_qos(channel, origin);
  // A rule was changed meanwhile, or the node has a name now.
  if (mirror.id && (qos != mirror.qos || moved)) destroy(mirror);
  mirror.qos = qos;
  channel.origins[origin.origin] = &mirror;
  mirror.fresh = true;  // the exporter sends its last samples by itself
  update_mirror(mirror, now);
  mirror.fresh = false;
}

Qos Imports::mirror_qos(const Channel& channel, const OriginOffer& origin) const {
  Qos qos = with_override(origin.qos, channel.decision.treatment.qos);
  if (qos.depth == 0) {
    const bool latched = qos.durability == Durability::kTransientLocal;
    qos.depth = latched ? options_.latched_depth : options_.default_depth;
  }
  qos.depth = std::min(qos.depth, kDepthMax);
  if (qos.durability == Durability::kTransientLocal && qos.history == History::kKeepAll) {
    qos.history = History::kKeepLast;  // or the mirror would keep all that the peer ever sends
    qos.depth = kDepthMax;
  }
  return qos;
}

void Imports::remove_candidate(Mirror& mirror, LinkId link, const Now& now) {
  deadline_known_ = false;
  const bool fed = mirror.candidates.front().link == link;
  std::erase_if(mirror.candidates, [&](const Candidate& c) { return c.link == link; });
  if (mirror.candidates.empty()) {
    mirror.ends_at = now.steady + kLinger;
    if (!mirror.id) mirrors_.erase(MirrorKey(mirror.key));
    return;
  }
  update_mirror(mirror, now, fed);
}

void Imports::remove_candidates(LinkId link, bool only_orphans, const Now& now) {
  for (auto it = mirrors_.begin(); it != mirrors_.end();) {
    Mirror& mirror = (it++)->second;
    const bool concerned = std::any_of(
        mirror.candidates.begin(), mirror.candidates.end(),
        [&](const Candidate& c) { return c.link == link && (!only_orphans || !c.channel); });
    if (!concerned) continue;
    if (!only_orphans && mirror.candidates.size() == 1) destroy(mirror);  // dead: at once
    remove_candidate(mirror, link, now);
  }
}

void Imports::update_mirror(Mirror& mirror, const Now& now, bool feeder_gone) {
  if (mirror.candidates.empty()) return;  // it lingers until ends_at
  deadline_known_ = false;
  auto& candidates = mirror.candidates;
  const auto fed = std::find_if(candidates.begin(), candidates.end(),
                                [](const Candidate& c) { return bool(c.channel); });
  bool taken_over = feeder_gone;
  if (fed != candidates.end() && !candidates.front().channel) {
    std::iter_swap(fed, candidates.begin());
    taken_over = true;
  }
  const Gid& gid = mirror.key.second;
  // A local publisher that has just ended may be offered for a moment longer: it is not mirrored
  // either.
  mirror.is_local = mirror.is_local || graph_.is_local(gid);
  const bool exists = graph_since_ && !mirror.failed && !mirror.is_local && !claims_.taken(gid) &&
                      !is_of_this_graph(candidates.front().link);
  if (exists && !mirror.id) {
    taken_over = true;
    create(mirror, now);
  }
  if (!exists && mirror.id) destroy(mirror);
  update_demands(mirror, now);
  if (!taken_over || mirror.fresh) return;
  // Its channel may be demanded for other origins already: then nobody sends this one's last
  // samples.
  const ChannelKey feeder{candidates.front().link, candidates.front().channel};
  const auto channel = channels_.find(feeder);
  const bool latched = mirror.origin.qos.durability == Durability::kTransientLocal;
  if (latched && channel != channels_.end() && channel->second.demanded)
    demand_again(feeder, channel->second, now);
}

// Both ends are in one graph: what the peer exports is here already, though our part of the
// middleware may discover it later than the peer's.
bool Imports::is_of_this_graph(LinkId link) const {
  const auto& connection = links_.at(link).connection;
  return connection && claims_.is_here(connection->peer().side);
}

void Imports::create(Mirror& mirror, const Now& now) {
  mirror.id = outputs_.new_mirror();
  mirror.last_stamp = 0;
  mirror.warned_qos = false;
  TimePoint settled = std::max(now.steady, *graph_since_ + kDiscovery);
  if (!graph_.bridges().empty()) settled = std::max(settled, now.steady + kSettle);
  if (settled > now.steady) mirror.settles_at = settled;
  const auto& [topic, type] = mirror.key.first;
  std::string node;
  if (options_.proxy_nodes && is_canonical_name(mirror.origin.node))
    node = options_.names.to_local(mirror.origin.node);
  outputs_.push(
      CreateMirror{mirror.id, topic, type, mirror.type_hash, mirror.qos, std::move(node)});
  claim_changed_ = true;
  warn_incompatible(mirror);
}

void Imports::destroy(Mirror& mirror) {
  if (!mirror.id) return;
  outputs_.push(DestroyMirror{mirror.id});
  mirror.id = {};
  mirror.settles_at.reset();
  claim_changed_ = true;
}

// Mirrors whose rule now asks for another QoS are made anew. The channel's demand ends for a
// moment, so that the exporter sends the last samples of transient-local origins to the new ones.
void Imports::renew(const ChannelKey& key, Channel& channel, const Now& now) {
  bool renewed = false;
  for (const auto& [id, mirror] : channel.origins) {
    const Qos qos = mirror_qos(channel, mirror->origin);
    if (mirror->candidates.front().link != key.first || qos == mirror->qos) continue;
    renewed = renewed || mirror->id;
    destroy(*mirror);
    mirror->qos = qos;
    update_mirror(*mirror, now);
  }
  if (renewed) demand_again(key, channel, now);
}

void Imports::demand_again(const ChannelKey& key, Channel& channel, const Now& now) {
  for (const auto& [id, mirror] : channel.origins)
    if (mirror->id) mirror->settles_at = now.steady + kSettle;
  deadline_known_ = false;
  update_demand(key, now);
}

void Imports::tell_once(LogLevel level, const std::string& text) {
  constexpr std::size_t kToldMax = 1024;
  if (told_.size() < kToldMax && told_.insert(text).second) outputs_.log(level, text);
}

void Imports::warn_incompatible(Mirror& mirror) {
  const TopicState* topic =
      mirror.id && !mirror.warned_qos ? graph_.find(mirror.key.first) : nullptr;
  if (!topic) return;
  for (const auto& subscriber : topic->subscribers) {
    const std::string policy = incompatible_policy(mirror.qos, subscriber.qos);
    if (policy.empty()) continue;
    mirror.warned_qos = true;
    outputs_.log(LogLevel::kWarn, topic->name + ": the " + policy + " that " + node_of(subscriber) +
                                      " requests is not offered by " + mirror.origin.node +
                                      " on the other side: it receives nothing from it");
    return;
  }
}

void Imports::expect_goal(const std::string& action, const Now& now) {
  deadline_known_ = false;
  for (const ActionPart part : {ActionPart::kFeedback, ActionPart::kStatus}) {
    const std::string name = name_of_part(action, part);
    for (auto it = mirrors_.lower_bound({{name, ""}, Gid{}});
         it != mirrors_.end() && it->first.first.first == name; ++it) {
      it->second.demanded_until = now.steady + kGoalDemand;
      update_demands(it->second, now);
    }
  }
}

void Imports::forget_orphans(LinkId link, const Now& now) {
  remove_candidates(link, true, now);
}

void Imports::on_link_dead(LinkId link, const Now& now) {
  remove_candidates(link, false, now);
}

void Imports::on_mirror_failed(const MirrorFailed& failed) {
  for (auto& [key, mirror] : mirrors_) {
    if (mirror.id != failed.mirror) continue;
    tell_once(LogLevel::kError, "cannot mirror " + key.first.first + ": " + failed.reason);
    mirror.failed = true;
    mirror.id = {};
    mirror.settles_at.reset();
    claim_changed_ = true;
    for (const auto& candidate : mirror.candidates) {
      if (!candidate.channel) continue;
      update_demand({candidate.link, candidate.channel}, Now{});
      links_.at(candidate.link).send(Decline{candidate.channel, failed.code, failed.reason});
    }
    return;
  }
}

void Imports::on_time(const Now& now) {
  deadline_known_ = false;
  for (auto it = mirrors_.begin(); it != mirrors_.end();) {
    Mirror& mirror = it->second;
    if (mirror.ends_at && *mirror.ends_at <= now.steady) {
      destroy(mirror);
      it = mirrors_.erase(it);
      continue;
    }
    ++it;
    bool changed = false;
    for (auto* at : {&mirror.settles_at, &mirror.demanded_until}) {
      if (!*at || **at > now.steady) continue;
      at->reset();
      changed = true;
    }
    if (changed) update_demands(mirror, now);
  }
}

std::optional<TimePoint> Imports::deadline() const {
  if (deadline_known_) return deadline_;
  deadline_known_ = true;
  std::optional<TimePoint>& first = deadline_;
  first.reset();
  for (const auto& [key, mirror] : mirrors_)
    for (const auto& at : {mirror.settles_at, mirror.ends_at, mirror.demanded_until})
      if (at) first = first ? std::min(*first, *at) : *at;
  return first;
}

std::vector<Gid> Imports::mirrored() const {
  std::vector<Gid> origins;
  for (const auto& [key, mirror] : mirrors_)
    if (mirror.id) origins.push_back(key.second);
  return origins;
}

}  // namespace connect_bridge
