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

// An answer to a request that is known to be taken proves nothing about later ones: a server with
// several threads may answer while no thread reads its queue.
void ServerQueue::answered(InvocationId request, TimePoint now) {
  const auto at = std::find_if(untaken_.begin(), untaken_.end(),
                               [&](const Entry& entry) { return entry.request == request; });
  if (at == untaken_.end()) return;
  untaken_.erase(untaken_.begin(), at + 1);
  progress_ = now;
}

// A failure may mean that the request never left, or that its answer cannot be used. So unlike an
// answer it proves nothing about earlier requests.
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
  // The time of later requests counts from the last answer: only then the server continues with
  // them. Otherwise requests behind long calls would count as taken while they still fill the
  // queue.
  if (untaken_.empty()) return std::nullopt;
  return std::max(untaken_.front().handed_over, progress_) + silence_max_;
}

}  // namespace connect_bridge
