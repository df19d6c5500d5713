#include "core/topics/first_messages.hpp"

#include <utility>

#include "core/topics/offered_topic.hpp"

namespace connect_bridge {

bool FirstMessages::keep(const Payload& raw, OfferedTopic* feeder) {
  // Messages with a max_age are better lost than late.
  if (!feeder || feeder->treatment().max_age != kForever) return false;
  if (raw.size() > kBytesMax || raw.size() > feeder->link().memory.room()) return false;
  bytes_ += raw.size();
  // A slice must not keep its whole packet while it waits.
  messages_.push_back(Payload::copy_of(raw.view()));
  while (messages_.size() > kMessagesMax || bytes_ > kBytesMax) {
    bytes_ -= messages_.front().size();
    messages_.pop_front();
    feeder->on_lost(1, DropReason::kQueueDepth);
  }
  held_.resize(bytes_);
  return true;
}

std::deque<Payload> FirstMessages::take() {
  bytes_ = 0;
  held_.resize(0);
  return std::exchange(messages_, {});
}

bool FirstMessages::are_due(const Now& now) {
  if (!until_ || until_.at() > now.steady) return false;
  until_.cancel();
  return true;
}

void FirstMessages::publish(Outputs& outputs, MirrorId mirror) {
  for (const auto& raw : take()) outputs.push(Publish{mirror, raw});
}

void FirstMessages::drop(OfferedTopic* feeder) {
  until_.cancel();
  const std::size_t count = take().size();
  if (feeder) feeder->on_lost(count, DropReason::kNoDemand);
}

}  // namespace connect_bridge
