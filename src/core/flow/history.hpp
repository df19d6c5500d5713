// The last samples of one transient-local topic, kept for links that start to demand it later.
#pragma once

#include <cstdint>
#include <iterator>
#include <limits>
#include <list>
#include <unordered_map>
#include <utility>

#include "core/base/budget.hpp"
#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {

// Each topic may keep so much even if the memory budget is used up: /tf_static and the robot
// description must not be lost because peers fill the memory.
inline constexpr std::uint64_t kHistoryFloorBytes = 1 << 20;

// Keeps the last `depth` samples of each origin, all together within `bytes_max` (beyond it the
// oldest sample of any origin is dropped; a sample larger than `bytes_max` is not kept).
class HistoryCache {
 public:
  struct Sample {
    OriginId origin;
    Stamp stamp = 0;
    std::uint64_t number = 0;
    Payload payload;
  };

  // No limits until they are set. Depth 0: limited by bytes only.
  void limit(std::uint32_t depth, std::uint64_t bytes_max) {
    depth_ = depth;
    bytes_max_ = bytes_max;
    for (auto& [origin, own] : by_origin_) {
      while (depth_ > 0 && own.size() > depth_) drop_oldest_of(own);
    }
    keep_bytes();
  }
  // Kept samples also count in this budget, which outlives this. When the budget is used up, the
  // oldest samples are dropped, down to kHistoryFloorBytes.
  void draw_from(Budget& memory) { held_ = memory.hold(bytes_); }

  void add(Sample sample) {
    // The sample would displace all others and then itself.
    if (sample.payload.size() > bytes_max_) return;
    bytes_ += sample.payload.size();
    samples_.push_back(std::move(sample));
    auto& own = by_origin_[samples_.back().origin];
    own.push_back(std::prev(samples_.end()));
    // First by depth: an origin that says much displaces its own samples, not those of others.
    if (depth_ > 0 && own.size() > depth_) drop_oldest_of(own);
    keep_bytes();
  }
  // The origin is gone: forgets its samples.
  void remove(OriginId origin) {
    const auto at = by_origin_.find(origin);
    if (at == by_origin_.end()) return;
    while (!at->second.empty()) drop_oldest_of(at->second);
    by_origin_.erase(at);
  }
  void clear() {
    samples_.clear();
    by_origin_.clear();
    bytes_ = 0;
    held_.resize(0);
  }

  // In order of arrival.
  [[nodiscard]] const std::list<Sample>& samples() const { return samples_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  using Samples = std::list<Sample>;
  using Own = std::list<Samples::const_iterator>;  // an origin's samples, oldest first

  void drop_oldest_of(Own& own) {
    bytes_ -= own.front()->payload.size();
    held_.resize(bytes_);
    samples_.erase(own.front());
    own.pop_front();
  }
  void keep_bytes() {
    held_.resize(bytes_);
    // The oldest of all is the oldest of its origin, too.
    while (bytes_ > bytes_max_ || (bytes_ > kHistoryFloorBytes && held_.is_full()))
      drop_oldest_of(by_origin_[samples_.front().origin]);
  }

  std::uint32_t depth_ = 0;
  std::uint64_t bytes_max_ = std::numeric_limits<std::uint64_t>::max();
  Budget::Hold held_;
  Samples samples_;
  std::unordered_map<OriginId, Own> by_origin_;
  std::uint64_t bytes_ = 0;
};

}  // namespace connect_bridge
