#include "core/mirrors/first_messages.hpp"

#include <algorithm>
#include <utility>

#include "core/mirrors/peer_topic.hpp"

namespace connect_bridge {
namespace {

// Leave a little early: a loop that is late must not find the message too old.
constexpr Duration kEarly = std::chrono::milliseconds(5);

}  // namespace

TimePoint FirstMessages::Waiting::leaves() const {
  return expires - kEarly;
}

void FirstMessages::wait(TimePoint found) {
  found_ = found;
  set_due();
}

void FirstMessages::set_due() {
  TimePoint at = found_;
  for (const Waiting& message : messages_) at = std::min(at, message.leaves());
  due_ = timers_.set(at);
}

bool FirstMessages::keep(const Payload& raw, TimePoint expires, PeerTopic* feeder) {
  if (!feeder) return false;
  if (raw.size() > kBytesMax || raw.size() > feeder->link().memory.room()) return false;
  bytes_ += raw.size();
  messages_.push_back({out_of_packet(raw), expires});
  while (messages_.size() > kMessagesMax || bytes_ > kBytesMax) {
    take();
    feeder->on_lost(1, DropReason::kQueueDepth);
  }
  held_.resize(bytes_);
  // The new message is not always the last to leave: another rule or link may give it less time.
  if (due_ && messages_.back().leaves() < due_.at()) set_due();
  return true;
}

Payload FirstMessages::take() {
  Payload first = std::move(messages_.front().raw);
  messages_.pop_front();
  bytes_ -= first.size();
  return first;
}

void FirstMessages::publish_due(Outputs& outputs, MirrorId mirror, PeerTopic* feeder,
                                const Now& now) {
  if (!due_ || due_.at() > now.steady) return;
  if (found_ <= now.steady) {
    due_.cancel();
    return publish(outputs, mirror, feeder, now);
  }
  // A message that cannot wait longer takes the older ones along, so that the order stays.
  // Subscribers that have not found the mirror yet lose all of these.
  const auto last = std::find_if(messages_.rbegin(), messages_.rend(), [&](const Waiting& message) {
    return message.leaves() <= now.steady;
  });
  publish_first(messages_.rend() - last, outputs, mirror, feeder, now);
  set_due();
}

void FirstMessages::publish(Outputs& outputs, MirrorId mirror, PeerTopic* feeder, const Now& now) {
  publish_first(std::ssize(messages_), outputs, mirror, feeder, now);
}

void FirstMessages::publish_first(std::ptrdiff_t count, Outputs& outputs, MirrorId mirror,
                                  PeerTopic* feeder, const Now& now) {
  for (; count > 0; --count) {
    // A message that waited for the name of its origin's node may be too old by now. It was counted
    // as published when it came (PeerTopic::on_lost).
    const bool fresh = messages_.front().expires >= now.steady;
    Payload raw = take();
    if (fresh) {
      outputs.push(Publish{mirror, std::move(raw)});
    } else if (feeder) {
      feeder->on_lost(1, DropReason::kMaxAge);
    }
  }
  held_.resize(bytes_);
}

void FirstMessages::drop(PeerTopic* feeder) {
  const std::size_t count = messages_.size();
  messages_.clear();
  bytes_ = 0;
  held_.resize(0);
  if (feeder) feeder->on_lost(count, DropReason::kNoDemand);
}

}  // namespace connect_bridge
