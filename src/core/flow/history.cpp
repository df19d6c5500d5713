#include "core/flow/history.hpp"

#include <iterator>
#include <utility>

namespace connect_bridge {

void HistoryCache::limit(std::uint32_t depth, std::uint64_t bytes_max) {
  depth_ = depth;
  bytes_max_ = bytes_max;
  for (auto& [origin, own] : by_origin_) {
    while (depth_ > 0 && own.size() > depth_) drop_oldest_of(own);
  }
  keep_bytes();
}

void HistoryCache::add(Sample sample) {
  // It would displace all others and then itself.
  if (sample.payload.size() > bytes_max_) return;
  bytes_ += sample.payload.size();
  samples_.push_back(std::move(sample));
  auto& own = by_origin_[samples_.back().origin];
  own.push_back(std::prev(samples_.end()));
  // First by depth: an origin that says much displaces its own samples, not those of others.
  if (depth_ > 0 && own.size() > depth_) drop_oldest_of(own);
  keep_bytes();
}

void HistoryCache::remove(OriginId origin) {
  const auto at = by_origin_.find(origin);
  if (at == by_origin_.end()) return;
  while (!at->second.empty()) drop_oldest_of(at->second);
  by_origin_.erase(at);
}

void HistoryCache::clear() {
  samples_.clear();
  by_origin_.clear();
  bytes_ = 0;
  held_.resize(0);
}

void HistoryCache::drop_oldest_of(Own& own) {
  bytes_ -= own.front()->payload.size();
  held_.resize(bytes_);
  samples_.erase(own.front());
  own.pop_front();
}

void HistoryCache::keep_bytes() {
  held_.resize(bytes_);
  // The oldest of all is the oldest of its origin, too.
  while (bytes_ > bytes_max_ || (bytes_ > kHistoryFloorBytes && held_.is_full()))
    drop_oldest_of(by_origin_[samples_.front().origin]);
}

}  // namespace connect_bridge
