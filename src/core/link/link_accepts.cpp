#include "core/link/link_accepts.hpp"

#include <algorithm>
#include <utility>

#include "core/wire/control.hpp"

namespace connect_bridge {
namespace {

// What an `accepts` costs beside its patterns, in patterns.
constexpr double kAcceptsPrice = 25;

}  // namespace

bool LinkAccepts::adopt(Accepts list) {
  if (list_) list.domain = list_->told().domain;  // it stays while the connection does
  // By one that nobody looked at the peer may have declined what it takes by this one.
  const bool passed_over = std::exchange(passed_over_, false);
  if (list_ && !passed_over && list_->told() == list) return false;
  list_.emplace(std::move(list), &memory_);
  ++lists_;
  return true;
}

bool LinkAccepts::take_completion() {
  if (completed_ || list_->lacks()) return false;
  return completed_ = true;
}

void LinkAccepts::put(Accepts list, const Now& now) {
  passed_over_ = passed_over_ || waiting_;
  waiting_ = std::move(list);
  due_ = now.steady;
}

std::optional<Accepts> LinkAccepts::take_due(TimePoint opened_at, const Now& now) {
  if (!due_ || *due_ > now.steady) return std::nullopt;
  due_ = due(opened_at, now);  // lists of other links may have been looked at meanwhile
  if (*due_ > now.steady) return std::nullopt;
  due_.reset();
  const double price = kAcceptsPrice + static_cast<double>(patterns_of(*waiting_));
  // The first of a connection may come before its time: then it costs nothing, or what is owed
  // would grow with each connection.
  for (Throttle* const pace : {&pace_, &of_account_})
    if (pace->ready(now.steady)) pace->take(price, now.steady);
  return std::exchange(waiting_, std::nullopt);
}

TimePoint LinkAccepts::due(TimePoint opened_at, const Now& now) const {
  const TimePoint paid_at = std::max(pace_.ready_at(), of_account_.ready_at());
  return std::max(now.steady, list_ ? paid_at : std::min(paid_at, opened_at + kFirstMax));
}

void LinkAccepts::lost() {
  list_.reset();
  completed_ = false;
  waiting_.reset();
  due_.reset();
  passed_over_ = false;
}

}  // namespace connect_bridge
