#include "core/topics/backlog.hpp"

#include <algorithm>
#include <utility>

namespace connect_bridge {
namespace {

// Sequence numbers begin again when they are used up (docs/protocol.md, "Sequence numbers").
bool is_behind(std::uint32_t sequence, std::uint32_t last) {
  return sequence != last && sequence - last < (std::uint32_t{1} << 31);
}

}  // namespace

void LinkBacklog::keep_bound() {
  while (bytes() > bytes_max_ || (bytes() > 0 && memory_.room() == 0)) {  // mutant: kept_bound
    // The new message may be the one that goes: it is in the topic with the most bytes, perhaps
    // alone. Each turn makes that topic smaller, so it ends.
    const auto most = std::max_element(topics_.begin(), topics_.end(), [](auto* a, auto* b) {
      return a->bytes_.amount() < b->bytes_.amount();
    });
    (*most)->drop_oldest(DropReason::kResumeBound);
  }
}

Backlog::Backlog(LinkBacklog& all, Link& link, Options options)
    : all_(all), link_(link), options_(std::move(options)), bytes_(all.bytes_.hold(0)) {
  all_.topics_.push_back(this);
}

Backlog::~Backlog() {
  std::erase(all_.topics_, this);
}

bool Backlog::admit(const OutSample& sample, const Now& now) {
  const std::size_t bytes = sample.raw.size();
  if (bytes > options_.message_bytes_max) {
    drop(DropReason::kTooLarge);
    return false;
  }
  if (options_.rates.of(sample.subject.origin()).admit(bytes, sample.header, now.steady))
    return true;
  drop(DropReason::kRate);
  return false;
}

void Backlog::add(OutMessage message) {
  const auto older = std::find_if(messages_.begin(), messages_.end(), [&](const OutMessage& m) {
    return message.state && m.sequence == 0 && m.subject == message.subject &&
           m.state == message.state;
  });
  if (older != messages_.end()) {
    dropped_.add(DropReason::kNewerAvailable);
    take_out(older);
  }
  bytes_.resize(bytes_.amount() + kept_bytes_of(message));
  ++by_origin_[message.subject.origin()];
  messages_.push_back(std::move(message));
  all_.keep_bound();
}

std::deque<OutMessage> Backlog::take(std::uint32_t after) {
  // Messages that were begun on the lost connection have a number and are the first. Of these the
  // peer says how far it has got; those without a number never left. What it has counts as arrived,
  // though no acknowledgement said so, and not as dropped (Backlogs::go_on).
  while (!messages_.empty() && messages_.front().sequence != 0 &&
         !is_behind(messages_.front().sequence, after))  // mutant: arrived_again
    messages_.pop_front();
  bytes_.resize(0);
  by_origin_.clear();
  all_.resumed_ += messages_.size();
  return std::exchange(messages_, {});
}

void Backlog::clear(DropReason reason) {
  while (!messages_.empty()) drop_oldest(reason);
}

void Backlog::drop(DropReason reason, std::uint64_t count) {
  dropped_.add(reason, count);
  all_.lost_ += count;
}

void Backlog::drop_oldest(DropReason reason) {
  take_out(messages_.begin());
  drop(reason);
}

void Backlog::take_out(std::deque<OutMessage>::iterator message) {
  const std::uint64_t bytes = kept_bytes_of(*message);
  const auto own = by_origin_.find(message->subject.origin());
  if (--own->second == 0) by_origin_.erase(own);
  messages_.erase(message);
  bytes_.resize(bytes_.amount() - bytes);
}

}  // namespace connect_bridge
