#include "core/services/server_queue.hpp"

#include <algorithm>

namespace connect_bridge {

void ServerQueue::hand_over(InvocationId request, TimePoint now) {
  if (untaken_.size() == kEntriesMax) untaken_.pop_front();
  untaken_.push_back({request, now});
}

bool ServerQueue::has_room(std::size_t depth, std::size_t coming, TimePoint now) {
  expire(now);
  return depth == 0 || untaken_.size() + coming < depth;  // mutant: server_queue
}

// The answer to a request that is known to be taken proves nothing about later ones: a server with
// several threads may answer while no thread reads its queue.
void ServerQueue::answered(InvocationId request, TimePoint now) {
  const auto at = std::find_if(untaken_.begin(), untaken_.end(),
                               [&](const Entry& entry) { return entry.request == request; });
  if (at == untaken_.end()) return;
  untaken_.erase(untaken_.begin(), at + 1);
  progress_ = now;
}

// That a request never left, and that its answer cannot be used, look alike here: so unlike an
// answer this proves nothing about the requests before it.
void ServerQueue::failed(InvocationId request) {
  std::erase_if(untaken_, [&](const Entry& entry) { return entry.request == request; });
}

void ServerQueue::expire(TimePoint now) {
  while (!untaken_.empty() && *deadline() <= now) untaken_.pop_front();
}

void ServerQueue::clear() {
  untaken_.clear();
  progress_ = TimePoint::min();
}

std::optional<TimePoint> ServerQueue::deadline() const {
  // An answer shows that the server goes on to those behind only now, so their time is counted from
  // then. Else what waits behind long calls would count as taken while it still fills the server's
  // queue.
  if (untaken_.empty()) return std::nullopt;
  return std::max(untaken_.front().handed_over, progress_) + silence_max_;
}

}  // namespace connect_bridge
