#include "ops/status/lately.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <utility>

#include "ops/status/status_json.hpp"

namespace connect_bridge {
namespace {

std::string name_of(bool exported, const std::string& name, const std::string& type) {
  return (exported ? ">" : "<") + name + " " + type;
}

}  // namespace

std::uint64_t RecentGrowth::to(std::uint64_t value, std::int64_t period) {
  if (value < last_) before_ = begun_ = last_ = 0;
  if (period != period_) {
    before_ = period == period_ + 1 ? begun_ : last_;
    begun_ = last_;
    period_ = period;
  }
  last_ = value;
  return value - before_;
}

double RecentPeak::to(double value, std::int64_t period) {
  if (period != period_) {
    before_ = period == period_ + 1 ? now_ : 0;
    now_ = value;
    period_ = period;
  }
  now_ = std::max(now_, value);
  return std::max(before_, now_);
}

double RecentThird::to(double value, std::int64_t period, TimePoint now) {
  if (period != period_) {
    before_ = period == period_ + 1 ? now_ : Largest{};
    now_ = {};
    period_ = period;
  }
  if (!looked_at_ || now - *looked_at_ >= kApart) {
    looked_at_ = now;
    for (double& one : now_)
      if (value > one) std::swap(value, one);
  }
  std::array<double, 6> all{};
  std::merge(before_.begin(), before_.end(), now_.begin(), now_.end(), all.begin(),
             std::greater<>());
  return all[2];
}

void Lately::on_second(double lag_ms, bool held_up, TimePoint now) {
  if (held_up) ++held_up_seconds_;
  lag_ms_.to(lag_ms, period(now));
  held_up_.to(held_up_seconds_, period(now));
}

void Lately::add(RunStatus& run, const Status& side, TimePoint now) {
  const std::int64_t at = period(now);
  // The last picture had all links that there were.
  std::erase_if(links_, [&](const auto& entry) { return entry.second.seen < looked_at_; });
  looked_at_ = now;
  run.lately = {lag_ms_.to(0, at),
                held_up_.to(held_up_seconds_, at),
                refused_.to(run.network.refused, at),
                wrong_logins_.to(side.strangers.wrong_logins, at),
                logins_not_judged_.to(side.strangers.logins_not_judged, at),
                static_cast<std::uint64_t>(memory_.to(static_cast<double>(side.shared_bytes), at))};
}

void Lately::add(LinkStatus& link, TimePoint now) {
  const std::int64_t at = period(now);
  OfLink& known = links_[link.number];
  known.seen = now;
  const auto queue_ms = known.path_queue_ms.to(milliseconds_of(link.path_queue), at, now);
  link.lately = {
      std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::milli>(queue_ms)),
      known.segments.to(link.segments, at), known.retransmitted.to(link.retransmitted, at)};
  // A lost link shows no topics and services until it is back, however late.
  if (!link.open) {
    for (auto& [name, topic] : known.topics) topic.seen = now;
    for (auto& [name, service] : known.services) service.seen = now;
  }
  for (TopicStatus& topic : link.topics) {
    OfTopic& of_topic = known.topics[name_of(topic.exported, topic.topic, topic.type)];
    of_topic.seen = now;
    TopicStatus::Lately grown{
        of_topic.messages.to(topic.messages, at), of_topic.wire_bytes.to(topic.wire_bytes, at), {}};
    for (std::size_t i = 0; i < kDropReasons; ++i)
      if (const std::uint64_t count = topic.dropped.by_reason[i]; count > 0)
        grown.dropped.by_reason[i] = of_topic.dropped[i].to(count, at);
    topic.lately = grown;
  }
  for (ServiceStatus& service : link.services) {
    OfService& of = known.services[name_of(service.exported, service.service, service.type)];
    of.seen = now;
    service.lately = {of.answered.to(service.answered, at), of.timed_out.to(service.timed_out, at),
                      of.refused.to(service.refused, at), of.lost.to(service.lost, at)};
  }
  if (!link.open) return;
  forget(known.topics, link.topics.size(), now);
  forget(known.services, link.services.size(), now);
}

// A peer may offer other names again and again.
template <class Entries>
void Lately::forget(Entries& known, std::size_t shown, TimePoint now) {
  if (known.size() > shown + kLeftOutMax)
    std::erase_if(known, [&](const auto& entry) { return entry.second.seen != now; });
}

}  // namespace connect_bridge
