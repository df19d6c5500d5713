#include "core/mirrors/peer_topics.hpp"

#include <algorithm>
#include <utility>

#include "core/policy/interface.hpp"

namespace connect_bridge {
namespace {

// Number of topics of all links that look for a place in a step, and of one link in its turn; and
// the time until others do that had no turn in this step.
constexpr std::size_t kLooksPerStep = 64;
constexpr std::size_t kLooksInTurn = 8;
constexpr Duration kOthersLook = std::chrono::milliseconds(40);

}  // namespace

void PeerTopics::on_offer(Link& link, const ChannelOffer& offer, const Now& now) {
  peers_.try_emplace(link.id, context_, link).first->second.on_offer(offer, now);
}

void PeerTopics::finish(const Link& link, const Now& now) {
  if (const auto peer = peers_.find(link.id); peer != peers_.end()) peer->second.finish(now);
}

bool PeerTopics::on_link_lost(LinkId link, LinkEnd& end, const Now& now) {
  const auto peer = peers_.find(link);
  if (peer == peers_.end()) return true;
  if (!peer->second.on_link_lost(end, now)) return false;
  context_.without_place.erase_if([link](LinkId waiting) { return waiting == link; });
  peers_.erase(peer);
  return true;
}

bool PeerTopics::on_link_dead(const Link& link, LinkEnd& end, const Now& now) {
  // lose_link() comes first, as it needs the candidate: if another link may feed the mirror
  // meanwhile, the returning link resumes nothing.
  for (TopicMirror* const mirror : context_.mirrors.of(link)) {
    if (!end.take()) return false;
    mirror->lose_link(link.id);
    context_.mirrors.remove_candidate(*mirror, link.id, now);
  }
  return true;
}

void PeerTopics::forget_orphans(const Link& link, const Now& now) {
  for (TopicMirror* const mirror : context_.mirrors.of(link))
    if (!mirror->candidate(link.id)->offered)
      context_.mirrors.remove_candidate(*mirror, link.id, now);
}

void PeerTopics::on_graph(const Now& now, const GraphDifference& difference) {
  const bool all = difference.all || !context_.graph_since;
  if (!context_.graph_since) context_.graph_since = now.steady;
  if (!all && difference.listened.empty() && difference.publishers.empty()) return;
  for (auto& [key, mirror] : context_.mirrors.all()) {
    if (!all && !difference.publishers.contains(key.second) &&
        !difference.listened.contains(key.first))
      continue;
    mirror.update(now);
    mirror.warn_incompatible(now);
  }
}

void PeerTopics::on_claims(LinkTable& links, const Now& now) {
  // Subscribers here get an origin from the bridge that mirrors it now. If the link resumed, they
  // would get messages twice (docs/protocol.md section 8.10, rule 3).
  for (auto& [id, link] : links)
    forget_origins(link.arrived, [&](const Gid& gid) { return context_.claims.taken(gid, false); });
  for (auto& [key, mirror] : context_.mirrors.all()) mirror.update(now);
}

std::optional<Decision> PeerTopics::permission(const Link& link, const TopicMirror& mirror) const {
  return import_right(context_, link, InterfaceKind::kTopic, mirror.key().first,
                      mirror.action_type());
}

bool PeerTopics::is_permitted_as_before(const TopicMirror& mirror) const {
  if (mirror.candidates().empty()) return false;
  const auto& [link, feeder, declined, qos, refused] = mirror.candidates().front();
  const auto decision = permission(*link, mirror);
  // The treatment of a lost link is checked when it offers the topic again.
  return decision && (!feeder || (decision->treatment == feeder->treatment() &&
                                  !feeder->withholds(mirror.origin())));
}

void PeerTopics::on_policy(const Now& now) {
  // Messages that wait in a mirror came under the rules before. Then all topics are judged, and
  // only then mirrors are renewed: so every feeder has been judged. A lost link has no topics to
  // judge, but its candidates are checked themselves. Last samples are requested at the end, from
  // the feeders of that moment.
  std::vector<MirrorKey> emptied;
  for (auto& [key, mirror] : context_.mirrors.all()) {
    if (!mirror.has_first() || is_permitted_as_before(mirror)) continue;
    mirror.drop_first();
    emptied.push_back(key);
  }
  for (auto& [link, peer] : peers_) peer.recheck(now);
  for (auto& [link, peer] : peers_) peer.renew(now);
  auto& mirrors = context_.mirrors.all();
  for (auto it = mirrors.begin(); it != mirrors.end();) {
    TopicMirror& mirror = (it++)->second;
    const auto candidates = mirror.candidates();  // a copy: the mirror may end with the last one
    for (const auto& [link, offered, declined, qos, refused] : candidates) {
      if (offered || permission(*link, mirror)) continue;
      context_.wheels.on_right_end(context_, mirror.key().first, *link, now);
      context_.mirrors.remove_candidate(mirror, link->id, now);
    }
  }
  for (const MirrorKey& key : emptied)
    if (const TopicMirror* const mirror = context_.mirrors.find(key))
      mirror->ask_for_last_samples(now);
}

void PeerTopics::expect_goal(const std::string& action, const Now& now) {
  // Without a subscriber there is no demand, and the first feedback would be lost until the graph
  // shows that the caller subscribes.
  for (const ActionPart part : {ActionPart::kFeedback, ActionPart::kStatus})
    for (auto& [key, mirror] : context_.mirrors.named(name_of_part(action, part)))
      mirror.expect_subscriber(now);
}

void PeerTopics::on_mirror_failed(const MirrorFailed& failed, const Now& now) {
  if (TopicMirror* const mirror = context_.mirrors.find(failed.id)) mirror->on_failed(failed, now);
}

void PeerTopics::on_type_differs(const TypeDiffers& differs) {
  if (const TopicMirror* const mirror = context_.mirrors.find(differs.id))
    mirror->tell_difference(differs.hash_here, true);
}

void PeerTopics::on_publish_failed(const PublishFailed& failed) {
  const TopicMirror* const mirror = context_.mirrors.find(failed.mirror);
  if (!mirror || mirror->candidates().empty()) return;
  if (auto* feeder = mirror->candidates().front().offered)
    feeder->on_lost(failed.count, DropReason::kPublishFailed);
}

void PeerTopics::on_clock(const Link& link, const Now& now) {
  if (const auto peer = peers_.find(link.id); peer != peers_.end()) peer->second.on_clock(now);
}

void PeerTopics::on_time(const Now& now) {
  context_.mirrors.on_time(now);
  for (std::size_t left = kHeldPerStep; left > 0;) {
    const auto due = context_.held.take_due(now.steady);
    if (!due) break;
    (*due)->publish_held(left, now);
  }
  context_.wheels.on_time(context_, now);
  if (context_.looks_again_at.value_or(TimePoint::max()) > now.steady) return;
  context_.looks_again_at.reset();
  look_for_places(now);
}

void PeerTopics::look_for_places(const Now& now) {
  std::map<LinkId, std::size_t> looked;
  std::vector<LinkTopics*> looked_all;
  std::size_t left = kLooksPerStep;
  while (left > 0) {
    const auto next = context_.without_place.take();
    if (!next) break;
    LinkTopics& peer = peers_.at(*next);
    const Outputs::Paying paying(context_.outputs, peer.link().account->time);
    std::size_t& of_link = looked[*next];
    const std::size_t more = peer.without_place() - std::min(peer.without_place(), of_link);
    const std::size_t looks = peer.try_left_out(std::min({more, left, kLooksInTurn}), now);
    left -= looks;
    of_link += looks;
    if (of_link < peer.without_place())
      peer.go_on_with_turns();
    else
      looked_all.push_back(&peer);
  }
  if (!context_.without_place.empty()) context_.look_again(now, kOthersLook);
  for (LinkTopics* const peer : looked_all) peer->go_on_with_turns();
}

void PeerTopics::send_demands() {
  for (const LinkId link : std::exchange(context_.demands_changed, {}))
    if (const auto peer = peers_.find(link); peer != peers_.end()) peer->second.send_demands();
}

bool PeerTopics::has_mirror(const TopicKey& key) const {
  return std::ranges::any_of(context_.mirrors.of(key),
                             [](const auto& one) { return bool(one.second.id()); });
}

void PeerTopics::add_status(const Link& link, LinkStatus& status) const {
  if (const auto peer = peers_.find(link.id); peer != peers_.end()) peer->second.add_status(status);
}

void PeerTopics::add_channels(const Link& link, std::vector<ChannelFacts>& channels) const {
  if (const auto peer = peers_.find(link.id); peer != peers_.end())
    peer->second.add_channels(channels);
}

std::uint64_t PeerTopics::memory_bytes() const {
  std::uint64_t bytes = 0;
  for (const auto& [link, peer] : peers_) bytes += peer.decoding().used();
  return bytes;
}

}  // namespace connect_bridge
