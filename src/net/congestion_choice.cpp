#include "net/congestion_choice.hpp"

#include <algorithm>
#include <utility>

namespace connect_bridge {
namespace {

constexpr std::uint64_t kSegments = 200;
constexpr std::uint64_t kLostMin = 3;
constexpr std::uint64_t kLostPerMille = 3;

}  // namespace

std::optional<bool> CongestionChoice::loses(const TcpCounts& counts) {
  const auto segments = counts.segments - told_.segments;
  if (segments < kSegments) return std::nullopt;
  // Of a segment that was repeated it may turn out later that it had come.
  const auto lost = counts.lost - std::min(counts.lost, told_.lost);
  told_ = {counts.segments, std::max(counts.lost, told_.lost)};
  return lost >= kLostMin && 1000 * lost >= kLostPerMille * segments;
}

// Two in a row decide: the start of a connection, or a cell that hands over, may lose a few at
// once.
std::optional<std::string_view> CongestionChoice::next(const TcpCounts& counts, TimePoint now) {
  const auto loses = this->loses(counts);
  if (!loses) return std::nullopt;
  const bool lasts = std::exchange(lost_, *loses) && *loses;
  if (*loses) lost_at_ = now;
  const auto before = chosen_;
  if (lasts) chosen_ = kWithLosses;
  if (now - lost_at_ >= kCalm) chosen_ = kFirst;
  return chosen_ == before ? std::nullopt : std::optional(chosen_);
}

}  // namespace connect_bridge
