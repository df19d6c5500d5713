#include "core/topics/backlog.hpp"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/check.hpp"

namespace connect_bridge {
namespace {

// Sequence numbers begin again when they are used up (docs/protocol.md, "Sequence numbers").
bool is_behind(std::uint32_t sequence, std::uint32_t last) {
  return sequence != last && sequence - last < (std::uint32_t{1} << 31);
}

// The key of the older message that this one replaces; none: the message replaces no other.
std::optional<std::pair<std::uint32_t, std::uint64_t>> state_of(const OutMessage& message) {
  if (!message.state) return std::nullopt;
  return std::pair{message.subject.value, *message.state};
}

// A message that has a number was begun to be sent: it stays.
bool is_replaced(const OutMessage& message) {
  return message.state && message.sequence == 0;
}

// The topic with the most bytes gives way by so many bytes at once: link by link the rest of a
// break comes in one piece.
constexpr std::uint64_t kGiveWayMax = 16U << 10;

}  // namespace

void DroppedMessages::free_some() {
  std::size_t left = kAtOnce;
  while (left > 0 && !begun_.empty()) {
    auto& messages = begun_.front();
    for (; left > 0 && !messages.empty(); --left) messages.pop_front();
    if (messages.empty()) begun_.pop_front();
  }
  while (left > 0 && !others_.empty()) {
    auto& messages = others_.front();
    for (; left > 0 && !messages.empty(); --left) messages.erase(messages.begin());
    if (messages.empty()) others_.pop_front();
  }
  if (begun_.empty() && others_.empty()) goes_on_at_.reset();
}

// The topic with the most bytes may lose the new message itself. Each turn makes that topic
// smaller, so both loops end.
void BacklogBound::keep() {
  while (bytes_ > bytes_max_)  // mutant: kept_bound
    by_bytes_.rbegin()->second->drop_oldest(std::min(bytes_ - bytes_max_, kGiveWayMax),
                                            DropReason::kResumeBound);
}

void LinkBacklog::keep() {
  while (bytes() > 0 && memory_.room() == 0)
    by_bytes_.rbegin()->second->drop_oldest(1, DropReason::kResumeBound);
}

Backlog::Backlog(LinkBacklog& all, Link& link, Options options)
    : all_(all),
      link_(link),
      options_(std::move(options)),
      number_(++all.bound_->backlogs_),
      bytes_(all.bytes_.hold(0)) {
  all_.by_bytes_.emplace(place(), this);
  all_.bound_->by_bytes_.emplace(place(), this);
}

Backlog::~Backlog() {
  resize(0);
  all_.bound_->by_bytes_.erase(place());
  all_.by_bytes_.erase(place());
}

void Backlog::resize(std::uint64_t bytes) {
  BacklogBound& bound = *all_.bound_;
  auto of_link = all_.by_bytes_.extract(place());
  auto of_identity = bound.by_bytes_.extract(place());
  bound.bytes_ = bound.bytes_ - bytes_.amount() + bytes;
  bytes_.resize(bytes);
  of_link.key() = of_identity.key() = place();
  all_.by_bytes_.insert(std::move(of_link));
  bound.by_bytes_.insert(std::move(of_identity));
}

bool Backlog::admit(const OutSample& sample, const Now& now) {
  const std::size_t bytes = sample.raw.size();
  if (bytes > options_.message_bytes_max) {
    drop(DropReason::kTooLarge);
    return false;
  }
  RateLimit& rate = options_.rates.of(sample.subject.origin());
  if (rate.admit(bytes, sample.header, now.steady, sample.rate_state(), sample.video)) return true;
  drop(DropReason::kRate);
  return false;
}

void Backlog::begin(std::deque<OutMessage> unarrived) {
  CONNECT_CHECK(size() == 0);
  const auto first = std::find_if(unarrived.begin(), unarrived.end(), is_replaced);
  std::vector<OutMessage> others(std::make_move_iterator(first),
                                 std::make_move_iterator(unarrived.end()));
  unarrived.erase(first, unarrived.end());
  oldest_ = std::move(unarrived);
  std::uint64_t bytes = 0;
  auto own = by_origin_.end();
  for (const OutMessage& message : oldest_) {
    bytes += kept_bytes_of(message);
    const OriginId origin = message.subject.origin();
    if (own == by_origin_.end() || own->first != origin) own = by_origin_.try_emplace(origin).first;
    ++own->second;
  }
  resize(bytes);
  all_.bound_->keep();
  all_.keep();
  for (OutMessage& message : others) add(std::move(message));
}

void Backlog::add(OutMessage message) {
  std::uint64_t bytes = bytes_.amount() + kept_bytes_of(message);
  if (const auto state = state_of(message)) {
    if (const auto older = states_.find(*state); older != states_.end()) {
      dropped_.add(DropReason::kNewerAvailable);
      bytes -= take_out(older->second);
    }
  }
  ++by_origin_[message.subject.origin()];
  const auto own = messages_.emplace_hint(messages_.end(), ++arrivals_, std::move(message));
  if (is_replaced(own->second)) states_[*state_of(own->second)] = own;
  resize(bytes);
  all_.bound_->keep();
  all_.keep();
}

std::deque<OutMessage> Backlog::take(std::uint32_t after) {
  // Messages that were begun on the lost connection come first and have a number. The peer reports
  // how far it has received those; messages without a number never left. Messages that the peer has
  // count as arrived, even without an acknowledgement, and not as dropped (Backlogs::go_on).
  const auto has_arrived = [&](const OutMessage& message) {
    return message.sequence != 0 && !is_behind(message.sequence, after);  // mutant: arrived_again
  };
  while (!oldest_.empty() && has_arrived(oldest_.front())) oldest_.pop_front();
  auto rest = messages_.begin();
  while (oldest_.empty() && rest != messages_.end() && has_arrived(rest->second)) ++rest;
  std::deque<OutMessage> taken = std::exchange(oldest_, {});
  for (; rest != messages_.end(); ++rest) taken.push_back(std::move(rest->second));
  states_.clear();
  messages_.clear();
  resize(0);
  by_origin_.clear();
  all_.resumed_ += taken.size();
  return taken;
}

void Backlog::clear(DropReason reason, DroppedMessages& dropped, const Now& now) {
  if (size() > 0) drop(reason, size());
  states_.clear();
  by_origin_.clear();
  dropped.add(std::exchange(oldest_, {}), std::exchange(messages_, {}), now);
  resize(0);
}

void Backlog::drop(DropReason reason, std::uint64_t count) {
  dropped_.add(reason, count);
  all_.lost_ += count;
}

void Backlog::drop_oldest(std::uint64_t bytes, DropReason reason) {
  std::uint64_t gone = 0, count = 0;
  for (; gone < bytes && size() > 0; ++count) gone += take_out_oldest();
  drop(reason, count);
  resize(bytes_.amount() - gone);
}

std::uint64_t Backlog::take_out_oldest() {
  if (oldest_.empty()) return take_out(messages_.begin());
  const std::uint64_t bytes = kept_bytes_of(oldest_.front());
  leave(oldest_.front().subject.origin());
  oldest_.pop_front();
  return bytes;
}

std::uint64_t Backlog::take_out(Messages::iterator message) {
  const std::uint64_t bytes = kept_bytes_of(message->second);
  leave(message->second.subject.origin());
  if (is_replaced(message->second)) states_.erase(*state_of(message->second));
  messages_.erase(message);
  return bytes;
}

void Backlog::leave(OriginId origin) {
  const auto own = by_origin_.find(origin);
  if (--own->second == 0) by_origin_.erase(own);
}

}  // namespace connect_bridge
