// Construction, jobs and status. Offers are in exports_offers.cpp, the way of a sample in
// exports_data.cpp.
#include "core/topics/exports.hpp"

#include <algorithm>
#include <utility>

#include "core/link/options.hpp"

namespace connect_bridge {

Exports::Exports(const SideOptions& options, const Policy& policy, const LocalActions& actions,
                 LinkTable& links, Jobs& jobs, Outputs& outputs)
    : options_(options),
      policy_(policy),
      actions_(actions),
      links_(links),
      jobs_(jobs),
      outputs_(outputs) {}

Exports::~Exports() = default;

Exports::Topic* Exports::topic_of(LinkId link, ChannelId channel) {
  const auto it = by_channel_.find({link, channel});
  return it == by_channel_.end() ? nullptr : it->second;
}

void Exports::on_lost(const MessagesLost& lost) {
  const auto it = by_subscription_.find(lost.subscription);
  if (it == by_subscription_.end()) return;
  for (auto& [link, exported] : it->second->links)
    if (exported.demanded)
      exported.dropped.add(lost.too_large ? DropReason::kTooLarge : DropReason::kQueueDepth,
                           lost.count);
  if (lost.too_large && !std::exchange(it->second->warned_large, true))
    outputs_.log(LogLevel::kWarn, it->second->key.first + ": " + std::to_string(lost.count) +
                                      " message(s) larger than max_message_size were dropped");
}

void Exports::on_subscription_failed(const SubscriptionFailed& failed) {
  const auto it = by_subscription_.find(failed.subscription);
  if (it == by_subscription_.end()) return;
  Topic& topic = *it->second;
  outputs_.log(LogLevel::kError, "cannot subscribe to " + topic.key.first + ": " + failed.reason);
  topic.failed = true;
  topic.subscription = {};
  by_subscription_.erase(it);
}

std::optional<TimePoint> Exports::deadline() const {
  if (vanishing_ == 0 && parked_samples_ == 0 && late_subscriptions_ == 0) return std::nullopt;
  std::optional<TimePoint> first;
  const auto earlier = [&](TimePoint t) { first = first ? std::min(*first, t) : t; };
  for (const auto& [key, topic] : topics_) {
    if (!topic.parked.empty()) earlier(topic.parked.front().until);
    if (topic.subscribes_at) earlier(*topic.subscribes_at);
    if (topic.vanishing == 0) continue;
    for (const auto& [gid, origin] : topic.origins)
      if (origin.vanishes_at) earlier(*origin.vanishes_at);
  }
  return first;
}

void Exports::add_status(const Link& link, LinkStatus& status) const {
  for (const auto& [key, topic] : topics_) {
    const auto it = topic.links.find(link.id);
    if (it == topic.links.end() || !it->second.channel) continue;
    const Export& exported = it->second;
    TopicStatus s;
    s.topic = key.first;
    s.type = key.second;
    s.exported = true;
    s.demanded = exported.demanded;
    s.origins = static_cast<std::uint32_t>(topic.origins.size());
    s.bytes = exported.raw_bytes;
    s.declined = exported.declined;
    s.dropped = exported.dropped;
    if (link.connection) {
      const ChannelCounts counts = link.connection->outbox().counts(exported.channel);
      s.messages = counts.sent;
      s.wire_bytes = counts.sent_bytes;
      s.queued = counts.queued;
      for (std::size_t i = 0; i < kDropReasons; ++i)
        s.dropped.by_reason[i] += counts.dropped.by_reason[i];
    }
    status.topics.push_back(std::move(s));
  }
}

std::uint64_t Exports::memory_bytes() const {
  std::uint64_t bytes = parked_bytes_;
  for (const auto& [key, topic] : topics_) {
    bytes += topic.history.bytes();
    for (const auto& [how, stream] : topic.encoders) bytes += stream.encoder.bytes();
  }
  return bytes;
}

}  // namespace connect_bridge
