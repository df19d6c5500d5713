#include "core/link/link_accepts.hpp"

#include <algorithm>
#include <utility>

namespace connect_bridge {

bool LinkAccepts::adopt(Accepts list) {
  // By one that nobody looked at the peer may have declined what it takes by this one.
  const bool passed_over = std::exchange(passed_over_, false);
  if (list_ && !passed_over && list_->told() == list) return false;
  list_.emplace(std::move(list));
  ++lists_;
  return true;
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
  // The first of a connection may come before its time: then it is not counted, or the pace would
  // fall behind with each connection.
  for (Pace* const pace : {&pace_, &of_account_}) static_cast<void>(pace->take(now.steady));
  return std::exchange(waiting_, std::nullopt);
}

TimePoint LinkAccepts::due(TimePoint opened_at, const Now& now) const {
  const TimePoint free_at = std::max(pace_.free_at(), of_account_.free_at());
  return std::max(now.steady, list_ ? free_at : std::min(free_at, opened_at + kFirstMax));
}

void LinkAccepts::lost() {
  list_.reset();
  completed_ = false;
  waiting_.reset();
  due_.reset();
  passed_over_ = false;
}

}  // namespace connect_bridge
