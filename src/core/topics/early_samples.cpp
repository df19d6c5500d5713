#include "core/topics/early_samples.hpp"

#include <utility>
#include <vector>

#include "core/topics/exported_topic.hpp"

namespace connect_bridge {
namespace {

// Longer than a bridge waits for the claims of others, and a slow path for its round trip.
constexpr Duration kAnswerMax = std::chrono::seconds(2);
constexpr Duration kJoinMax = std::chrono::seconds(1);  // since the first sample
constexpr std::size_t kSamplesMax = 100;                // of a topic, for one link
constexpr std::uint64_t kBytesMax = 1 << 20;            // the same
constexpr std::uint64_t kAccountBytesMax = 4 << 20;     // of all topics, for one identity
constexpr std::uint64_t kAllBytesMax = 16 << 20;        // of all topics

}  // namespace

bool EarlySamples::is_awaited(const TopicOffer& offer, LinkId link) const {
  // What is kept since the link was lost has these samples, too.
  return offer.is_open() && !offer.demanded() && !over_.contains(link) &&
         !backlogs_.contains(link) && context_.listeners.listens(topic_.key(), link);
}

QosOverride EarlySamples::rules_of_awaited() const {
  return context_.listeners.rules_of(topic_.key(), [this](LinkId link) {
    const auto offer = offers_.find(link);
    return offer == offers_.end() ||
           (is_awaited(offer->second, link) && !offer->second.is_declined());
  });
}

void EarlySamples::add(const OutSample& sample, const Now& now) {
  // A link that joins gets the samples before this one first, so that its order is that of the
  // others.
  for (auto& [link, offer] : offers_)
    if (is_awaited(offer, link) && !waiting_.contains(link)) join(offer, link, now);
  for (auto& [link, offer] : offers_)
    if (is_awaited(offer, link)) keep(offer, link, sample, now);
}

// Of bridges in one graph the first that listens may give way to another one. So a link that
// listens a little later gets what no link has got yet.
void EarlySamples::join(TopicOffer& offer, LinkId link, const Now& now) {
  const Waiting* oldest = nullptr;
  for (const auto& [other, waiting] : waiting_)
    if (oldest == nullptr || waiting.first < oldest->first) oldest = &waiting;
  if (oldest == nullptr || now.steady - oldest->first >= kJoinMax) return;
  for (const OutSample& sample : oldest->samples) keep(offer, link, sample, now);
  if (const auto joined = waiting_.find(link); joined != waiting_.end())
    joined->second.first = oldest->first;
}

void EarlySamples::keep(TopicOffer& offer, LinkId link, const OutSample& sample, const Now& now) {
  const std::size_t bytes = sample.raw.size();
  // A peer makes this side keep samples just by saying that it listens, to as many topics as it
  // likes. So beyond the limits of its identity and of all nothing new is kept; within those of the
  // topic the oldest gives way.
  Budget& of_account = offer.link().account->early;
  if (bytes > kBytesMax || of_account.used() + bytes > kAccountBytesMax ||
      context_.early.used() + bytes > kAllBytesMax)
    return offer.drop(DropReason::kQueueBytes);
  if (bytes > context_.early.room()) return offer.drop(DropReason::kMemory);
  const auto [it, is_new] = waiting_.try_emplace(link);
  Waiting& waiting = it->second;
  if (is_new) {
    waiting.first = now.steady;
    waiting.until = context_.timers.set(now.steady + kAnswerMax, &topic_);
    waiting.bytes = context_.early.hold(0);
    waiting.account = offer.link().account;
    waiting.of_account = of_account.hold(0);
  }
  waiting.samples.push_back(sample);
  std::uint64_t held = waiting.bytes.amount() + bytes;
  std::size_t dropped = 0;
  while (waiting.samples.size() > kSamplesMax || held > kBytesMax) {
    held -= waiting.samples.front().raw.size();
    waiting.samples.pop_front();
    ++dropped;
  }
  waiting.bytes.resize(held);
  waiting.of_account.resize(held);
  if (dropped > 0) offer.drop(DropReason::kQueueDepth, dropped);
}

std::deque<OutSample> EarlySamples::answer(LinkId link) {
  // From now on its demand decides, whatever it was: what is published goes the usual way.
  over_.insert(link);
  const auto waiting = waiting_.find(link);
  if (waiting == waiting_.end()) return {};
  auto samples = std::move(waiting->second.samples);
  waiting_.erase(waiting);
  return samples;
}

void EarlySamples::on_time(const Now& now) {
  std::vector<LinkId> late;
  for (const auto& [link, waiting] : waiting_)
    if (waiting.until.at() <= now.steady) late.push_back(link);
  for (const LinkId link : late) {
    // For this offer the link is over with that: what is published later is not kept for it either.
    const std::size_t count = answer(link).size();
    if (const auto offer = offers_.find(link); offer != offers_.end())
      offer->second.drop(DropReason::kNoDemand, count);
  }
}

void EarlySamples::forget(LinkId link) {
  waiting_.erase(link);
  over_.erase(link);
}

void EarlySamples::clear() {
  waiting_.clear();
  over_.clear();
}

}  // namespace connect_bridge
