#include "core/jobs/encoder.hpp"

#include <algorithm>
#include <utility>

#include "core/media/sample_codec.hpp"

namespace connect_bridge {
namespace {

// A queue that waits for longer exceeds what the links can carry; a burst does not.
constexpr Duration kStands = std::chrono::milliseconds(100);

}  // namespace

// Samples leave in the order in which they came, whatever their sizes: one at a time is with a
// worker, and none behind it begins, not even a small one. A sample begins only when next() asks
// for it. So what the links cannot carry is displaced here, before it has cost processor time.

std::vector<Encoder::Displaced> Encoder::push(OutSample sample) {
  std::vector<Displaced> displaced;
  const bool stands = !waiting_.empty() && sample.taken - waiting_.front().taken > kStands;
  for (std::size_t i = 0; stands && sample.state && i < waiting_.size();) {
    const OutSample& older = waiting_[i];
    if (older.subject == sample.subject && older.state == sample.state) {
      displaced.push_back({take_waiting(i), DropReason::kNewerAvailable});
    } else {
      ++i;
    }
  }
  waiting_bytes_ += sample.raw.size();
  waiting_.push_back(std::move(sample));
  // The newest always stays, however large it is; what a worker has is not counted.
  while (waiting_.size() > 1 && ((options_.depth > 0 && waiting_.size() > options_.depth) ||
                                 waiting_bytes_ > options_.queue_bytes_max))
    displaced.push_back({take_waiting(), DropReason::kQueueBytes});
  return displaced;
}

void Encoder::finish(std::optional<Payload> result) {
  job_.cancel();
  finished_ = whole(*std::exchange(at_work_, std::nullopt), std::move(result));
}

std::optional<Encoder::Encoded> Encoder::next() {
  if (finished_) return std::exchange(finished_, std::nullopt);
  if (job_ || waiting_.empty()) return std::nullopt;
  OutSample sample = take_waiting();
  if (jobs_.is_large(sample.raw.size())) {
    job_ = jobs_.compress(owner_, options_.how, sample.raw);
    at_work_ = std::move(sample);
    return std::nullopt;
  }
  std::optional<Payload> body;
  if (auto bytes = media::encode_sample(sample.raw.view(), options_.how))
    body = Payload::adopt(std::move(*bytes));
  return whole(std::move(sample), std::move(body));
}

Encoder::Encoded Encoder::pass() {
  return whole(take_waiting(), std::nullopt);
}

// A sample that a worker has stays at work, though perhaps for no link any more: the job is on its
// way, and the next sample follows its result.
std::vector<OutSample> Encoder::forget(LinkId link) {
  std::vector<OutSample> forgotten;
  const auto leave = [&](OutSample& sample) {
    const bool was_for_it = std::erase(sample.targets, link) > 0;
    if (was_for_it) forgotten.push_back(sample);
    return was_for_it && sample.targets.empty();
  };
  if (at_work_) leave(*at_work_);
  std::erase_if(waiting_, [&](OutSample& sample) {
    const bool unwanted = leave(sample);
    if (unwanted) waiting_bytes_ -= sample.raw.size();
    return unwanted;
  });
  return forgotten;
}

bool Encoder::holds(LinkId link) const {
  const auto is_for = [link](const OutSample& sample) {
    return std::find(sample.targets.begin(), sample.targets.end(), link) != sample.targets.end();
  };
  return works_for(link) || std::any_of(waiting_.begin(), waiting_.end(), is_for);
}

std::vector<OutSample> Encoder::clear() {
  job_.cancel();
  std::vector<OutSample> dropped;
  if (auto sample = std::exchange(at_work_, std::nullopt)) dropped.push_back(std::move(*sample));
  while (!waiting_.empty()) dropped.push_back(take_waiting());
  return dropped;
}

Encoder::Encoded Encoder::whole(OutSample sample, std::optional<Payload> body) const {
  if (body) return {std::move(sample), options_.how.codec, *std::move(body)};
  Payload raw = sample.raw;
  return {std::move(sample), Codec::kNone, std::move(raw)};
}

OutSample Encoder::take_waiting(std::size_t index) {
  OutSample sample = std::move(waiting_[index]);
  waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(index));
  waiting_bytes_ -= sample.raw.size();
  return sample;
}

}  // namespace connect_bridge
