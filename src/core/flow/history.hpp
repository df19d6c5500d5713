// The last samples of one transient-local topic, kept for links that start to demand it later.
#pragma once

#include <cstdint>
#include <limits>
#include <list>
#include <unordered_map>

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
  void limit(std::uint32_t depth, std::uint64_t bytes_max);
  // What is kept also counts in this budget, which outlives this; when the budget is used up, the
  // oldest samples are dropped, down to kHistoryFloorBytes.
  void draw_from(Budget& memory) { held_ = memory.hold(bytes_); }

  void add(Sample sample);
  // The origin is gone: forgets its samples.
  void remove(OriginId origin);
  void clear();

  // In order of arrival.
  [[nodiscard]] const std::list<Sample>& samples() const { return samples_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  using Samples = std::list<Sample>;
  using Own = std::list<Samples::const_iterator>;  // an origin's samples, oldest first

  void drop_oldest_of(Own& own);
  void keep_bytes();

  std::uint32_t depth_ = 0;
  std::uint64_t bytes_max_ = std::numeric_limits<std::uint64_t>::max();
  Budget::Hold held_;
  Samples samples_;
  std::unordered_map<OriginId, Own> by_origin_;
  std::uint64_t bytes_ = 0;
};

}  // namespace connect_bridge
