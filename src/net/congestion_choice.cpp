#include "net/congestion_choice.hpp"

#include <algorithm>
#include <utility>

namespace connect_bridge {
namespace {

constexpr std::uint64_t kSegments = 200;  // so many tell the weather
constexpr std::uint64_t kLostMin = 3;
constexpr std::uint64_t kLostPerMille = 3;
constexpr std::uint32_t kQueueUs = 20'000;

bool is_queue_long(const TcpCounts& counts) {
  return counts.round_trip_us > 2 * counts.round_trip_min_us + kQueueUs;
}

}  // namespace

std::optional<CongestionChoice::Weather> CongestionChoice::weather(const TcpCounts& counts) {
  const auto lost = counts.lost - std::min(counts.lost, seen_);
  seen_ = std::max(seen_, counts.lost);
  (is_queue_long(counts) ? long_ : short_) += lost;
  const auto segments = counts.segments - told_;
  if (segments < kSegments) return std::nullopt;
  told_ = counts.segments;
  const auto with_short = std::exchange(short_, 0), with_long = std::exchange(long_, 0);
  const auto most = std::max(with_short, with_long);
  if (most < kLostMin || 1000 * most < kLostPerMille * segments) return Weather::kCalm;
  return with_long >= with_short ? Weather::kFull : Weather::kLossy;
}

// Two in a row decide: the start of a connection, or a cell that hands over, may lose a few at
// once.
std::optional<std::string_view> CongestionChoice::next(const TcpCounts& counts, TimePoint now) {
  const auto weather = this->weather(counts);
  if (!weather) return std::nullopt;
  const bool lasts = std::exchange(last_, *weather) == *weather;
  if (*weather != Weather::kCalm) lossy_at_ = now;
  const auto before = chosen_;
  if (lasts && *weather == Weather::kLossy) chosen_ = kWithLosses;
  if (lasts && *weather == Weather::kFull) chosen_ = kFirst;
  if (now - lossy_at_ >= kCalm) chosen_ = kFirst;
  return chosen_ == before ? std::nullopt : std::optional(chosen_);
}

}  // namespace connect_bridge
