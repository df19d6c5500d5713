#include "core/topics/import_context.hpp"

#include <algorithm>
#include <bit>

#include "core/link/link_audit.hpp"
#include "core/policy/interface.hpp"
#include "core/topics/clock_publisher.hpp"
#include "core/topics/peer_topic.hpp"

namespace connect_bridge {
namespace {

// "/chatter", or "/chatter of /talker"
std::string name_of(const TopicMirror& mirror, bool with_node) {
  const auto& [topic, type] = mirror.key().first;
  const std::string what = shown(InterfaceKind::kTopic, topic, type);
  const std::string& node = mirror.origin().node;
  return with_node && !node.empty() ? what + " of " + node : what;
}

}  // namespace

// Earlier offers of the link count until they are forgotten, so reconnecting again and again gives
// no more mirrors.
TopicMirror* ImportContext::mirror_of(const MirrorKey& key, const Link& link) {
  const auto known = mirrors.find(key);
  const bool is_known = known != mirrors.end();
  if (is_known && known->second.candidate(link.id)) return &known->second;
  // The narrowest limit comes first: of the link, then of one topic of the link. The last one is
  // the identity's share of the places that all use.
  if (link.mirrors.all() >= options.mirrors_max) return nullptr;  // mutant: mirrors_max
  if (link.mirrors.of(key.first) >= options.topic_mirrors_max) return nullptr;
  if (!is_known && link.account->places.room() == 0) return nullptr;
  return &mirrors.try_emplace(key, *this, key).first->second;
}

std::vector<TopicMirror*> ImportContext::mirrors_of(const Link& link) {
  std::vector<TopicMirror*> found;
  found.reserve(link.mirrors.all());
  for (const auto& [topic, count] : link.mirrors.by_topic())
    for (auto it = mirrors.lower_bound({topic, Gid{}});
         it != mirrors.end() && it->first.first == topic; ++it)
      if (it->second.candidate(link.id)) found.push_back(&it->second);
  return found;
}

void ImportContext::unmake(MirrorId mirror, bool existed) {
  const auto ended = made.extract(mirror);
  if (ended.mapped().gid != Gid{}) unmade.push_back(ended.mapped().gid);
  if (existed) leave_name(*ended.mapped().mirror);
}

// A middleware may refuse a second type of a name. A node that was killed and returns with another
// type is heard when the mirror of its former publisher ends.
void ImportContext::leave_name(const TopicMirror& ended) {
  const auto& [name, type] = ended.key().first;
  std::vector<TopicMirror*> others;
  for (auto it = mirrors.lower_bound({{name, ""}, Gid{}});
       it != mirrors.end() && it->first.first.first == name; ++it) {
    TopicMirror& mirror = it->second;
    if (mirror.key().first.second != type) {
      others.push_back(&mirror);
    } else if (mirror.id() && &mirror != &ended) {
      return;
    }
  }
  for (TopicMirror* const other : others) other->try_again();  // mutant: other_type_ends
}

// Kept bytes count four times in room(). So with a share of a quarter, the mirrors of a link leave
// at least as much to its messages as they hold themselves.
std::uint64_t ImportContext::mirror_room(const TopicMirror& mirror, std::uint64_t share) const {
  const Budget& latched = mirror.candidates().front().link->mirrors.latched();
  const std::uint64_t own = mirror.kept_bytes();
  const std::uint64_t others = latched.used() - std::min(latched.used(), own);
  return std::min(options.mirror_bytes_max - std::min(others, options.mirror_bytes_max),
                  latched.room() / share + own);
}

// A power of two: so a peer whose samples grow and grow makes us recreate the publisher only a few
// times. A single sample may take more of the remaining room than several.
std::uint32_t ImportContext::mirror_depth(const TopicMirror& mirror, std::uint32_t depth,
                                          std::uint64_t sample_bytes) const {
  const std::uint64_t several = mirror_room(mirror, 8) / sample_bytes;
  if (several >= depth) return depth;
  if (several > 0) return static_cast<std::uint32_t>(std::bit_floor(several));
  return mirror_room(mirror, 4) < sample_bytes ? 0 : 1;
}

void ImportContext::tell_once(const TopicMirror& mirror, LogLevel level,
                              const std::string& text) const {
  if (!mirror.candidates().empty())
    outputs.log_once(mirror.candidates().front().link->account->told, level, text);
}

void ImportContext::tell_failed(const TopicMirror& mirror, const MirrorFailed& failed) const {
  if (!failed.hash_here.empty()) return tell_difference(mirror, failed.hash_here, false);
  tell_once(
      mirror, LogLevel::kError,
      "cannot mirror " + name_of(mirror, failed.code == "type_mismatch") + ": " + failed.reason);
}

void ImportContext::tell_difference(const TopicMirror& mirror, const std::string& hash_here,
                                    bool used) const {
  if (mirror.candidates().empty()) return;
  log_difference(
      outputs, *mirror.candidates().front().link,
      {name_of(mirror, true), mirror.key().first.second, hash_here, mirror.type_hash(), used});
}

// Not for an action: its goals have ids, so its old status misleads nobody, and its services follow
// it. Not beside another bridge: it could claim the mirror while we recreate it. Not if one
// publisher is volatile: then the exporter keeps no samples to send again.
bool ImportContext::forget_kept(const std::map<OriginId, TopicMirror*>& origins,
                                const PeerTopic& feeder, const Now& now) const {
  if (!feeder.all_come_again() || !feeder.action_type().empty() || beside_bridges()) return false;
  for (const auto& [id, mirror] : origins) {
    if (mirror->candidates().front().offered != &feeder || mirror->kept_bytes() == 0) continue;
    mirror->destroy();
    mirror->update(now);
  }
  return true;
}

bool ImportContext::has_simulated_time() const {
  if (options.clock_publish_period > Duration::zero()) return true;
  const TopicKey clock{"/clock", kClockType};
  const TopicState* const here = graph.find(clock);
  if (here && !here->publishers.empty()) return true;
  return std::any_of(made.begin(), made.end(), [&](const auto& one) {
    return one.second.mirror->key().first.second == kClockType;
  });
}

std::string ImportContext::misfit(const TopicKey& topic,
                                  const std::map<OriginId, TopicMirror*>& origins) const {
  std::vector<Qos> published;
  for (const auto& [id, mirror] : origins)
    if (mirror->id()) published.push_back(mirror->qos());
  const TopicState* state = graph.find(topic);
  return state && graph_options.qos_must_fit ? unmet_policy(*state, published) : std::string();
}

void ImportContext::remove_candidate(TopicMirror& mirror, LinkId link, const Now& now) {
  mirror.remove_candidate(link, now);
  if (mirror.is_over()) mirrors.erase(MirrorKey(mirror.key()));
}

}  // namespace connect_bridge
