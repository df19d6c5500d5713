#include "net/congestion_choice.hpp"

#include <algorithm>

namespace connect_bridge {
namespace {

constexpr std::uint64_t kSegments = 200;
constexpr std::uint64_t kLostMin = 3;
constexpr std::uint64_t kLostPerMille = 3;
constexpr Duration kTogether = std::chrono::seconds(30);

}  // namespace

std::optional<bool> CongestionChoice::loses(const TcpCounts& counts) {
  if (counts.segments < told_.segments) told_ = counts;  // the kernel's counts have 32 bits
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
  const auto before = chosen_;
  if (const auto loses = this->loses(counts)) {
    const bool lasts = lost_ && *loses && now - lost_at_ < kTogether;
    lost_ = *loses;
    if (lost_) lost_at_ = now;
    if (lasts) chosen_ = kWithLosses;
  }
  if (now - lost_at_ >= kCalm) chosen_ = kFirst;
  return chosen_ == before ? std::nullopt : std::optional(chosen_);
}

}  // namespace connect_bridge
