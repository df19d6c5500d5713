#include "core/mirrors/link_topics.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "core/media/sample_codec.hpp"
#include "core/offers/import_right.hpp"

namespace connect_bridge {
namespace {

// Time until topics look for a place again. It is shorter if some places were free, since more may
// be.
constexpr Duration kLooksAgain = std::chrono::seconds(1);
constexpr Duration kMoreFree = std::chrono::milliseconds(10);

}  // namespace

void LinkTopics::on_offer(const ChannelOffer& offer, const Now& now) {
  auto import = judge(context_, link_, offer);
  if (!import) return;
  // Rules and limits for a topic apply to one channel.
  if (!names_.insert(import->key).second)
    return decline(context_, link_, offer, "limit", "the topic is offered on another channel");
  note_import(context_, link_, offer, import->decision.rule);
  PeerTopic& topic =
      topics_.try_emplace(offer.channel, *this, import->key, offer, std::move(import->decision))
          .first->second;
  for (const auto& origin : offer.origins) topic.add_origin(origin, now);
}

void LinkTopics::recheck(const Now& now) {
  for (auto it = topics_.begin(); it != topics_.end();) {
    PeerTopic& topic = it->second;
    if (topic.recheck(now)) {
      ++it;
      continue;
    }
    topic.decline(now);
    it = topics_.erase(it);
  }
}

// A place becomes free when another publisher ends: of this topic, of another one, or of another
// link of the identity. Thousands of topics may wait for a place, so they take turns.
std::size_t LinkTopics::try_left_out(std::size_t most, const Now& now) {
  const std::size_t looks = std::min(without_place(), most);
  bool any = false;
  for (std::size_t n = looks; n > 0; --n) {
    auto next = left_out_.upper_bound(looked_at_);
    if (next == left_out_.end()) next = left_out_.begin();
    looked_at_ = *next;
    const auto found = topics_.find(looked_at_);
    if (found != topics_.end()) {
      PeerTopic& topic = found->second;
      const auto has_place = [&](const OriginOffer& origin) {
        return topic.withholds(origin) || context_.mirrors.open({topic.key(), origin.gid}, link_);
      };
      while (const auto origin = topic.left_out().take(has_place)) {
        topic.add_origin(*origin, now);
        any = true;
      }
      if (topic.left_out().size() > 0) continue;
    }
    left_out_.erase(next);
  }
  if (!left_out_.empty()) context_.look_again(now, any ? kMoreFree : kLooksAgain);
  return looks;
}

void LinkTopics::note_left_out(ChannelId number) {
  left_out_.insert(number);
  if (!has_turn_) go_on_with_turns();
}

void LinkTopics::go_on_with_turns() {
  has_turn_ = without_place() > 0;
  if (has_turn_) context_.without_place.add(link_.account->number, link_.id, link_.id);
}

void LinkTopics::renew(const Now& now) {
  for (auto& [number, topic] : topics_) topic.renew(now);
}

void LinkTopics::finish(const Now& now) {
  at_once_ = Throttle(kAtOnceMax, {});  // a full allowance, whatever was withdrawn just before
  for (auto& [number, topic] : topics_) topic.finish(now);
  finished_ = true;
}

std::optional<Payload> LinkTopics::decompress_at_once(const InMessage& message, const Now& now) {
  if (message.codec == Codec::kNone) return message.body;
  // Columns are put together value by value.
  constexpr double kSlower = 8;
  const bool is_slow = message.codec == Codec::kPlanes || message.codec == Codec::kCloud;
  const double bytes = (is_slow ? kSlower : 1) * static_cast<double>(message.raw_bytes);
  if (at_once_.owed(now.steady) + bytes > kAtOnceMax) return std::nullopt;
  // Counted before the attempt: bytes that do not decompress cost their time, too.
  at_once_.take(bytes, now.steady);
  auto raw = media::decode_sample(message.body.view(), message.codec, message.raw_bytes);
  if (!raw) return std::nullopt;
  return Payload::adopt(std::move(raw).value());
}

bool LinkTopics::on_link_lost(LinkEnd& end, const Now& now) {
  for (auto it = topics_.begin(); it != topics_.end(); it = topics_.erase(it)) {
    if (!end.take()) return false;
    it->second.leave_counts();
    it->second.lose(now);
  }
  return true;
}

void LinkTopics::on_clock(const Now& now) {
  // Impossible replies measure nothing.
  if (!link_.clock().known() || std::exchange(has_clock_, true)) return;
  for (auto& [number, topic] : topics_) topic.publish_unjudged(now);
}

void LinkTopics::change_demand(const PeerTopic& topic, bool on) {
  context_.demands_changed.insert(link_.id);
  context_.outputs.follow_up(FollowUp::kDemands);
  auto& now_in = on ? wants_ : ends_;
  auto& before_in = on ? ends_ : wants_;
  // A change that is reversed before it was sent is never sent: both sides go on as if nothing had
  // happened.
  if (std::erase(before_in, topic.number()) == 0) now_in.push_back(topic.number());
}

void LinkTopics::send_demands() {
  // A topic may be withdrawn by now. Ends go first: a channel may be demanded again under a new
  // number. All new demands share one number, as it only compares messages of one channel.
  Demand demand;
  for (const ChannelId number : std::exchange(ends_, {})) {
    if (const auto topic = topics_.find(number); topic != topics_.end()) topic->second.end_demand();
    demand.channels.push_back({.channel = number});
  }
  if (!wants_.empty() && ++demands_ == 0) ++demands_;
  for (const ChannelId number : std::exchange(wants_, {}))
    if (const auto topic = topics_.find(number); topic != topics_.end())
      demand.channels.push_back(topic->second.begin_demand(demands_));
  if (!demand.channels.empty()) link_.send(demand);
}

void LinkTopics::add_status(LinkStatus& status) const {
  for (const auto& [number, topic] : topics_) topic.add_status(status);
}

void LinkTopics::add_channels(std::vector<ChannelFacts>& channels) const {
  for (const auto& [number, topic] : topics_) topic.add_channel(channels);
}

}  // namespace connect_bridge
