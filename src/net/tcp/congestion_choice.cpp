#include "net/tcp/congestion_choice.hpp"

#include <algorithm>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kSegments = 200;
constexpr std::uint64_t kLostMin = 4;
constexpr std::uint64_t kLostPerMille = 3;
// The start of a connection, a cell that hands over, and a queue that somebody else fills lose many
// segments at once. Losses that come so often are something else.
constexpr int kTimes = 3;
constexpr Duration kTogether = 3s;
constexpr Duration kTogetherMost = 30s;  // if fewer than kSegments leave in kTogether

// While a path is gone, TCP repeats the same segments again and again, and sends nothing new.
bool loses_of_new(std::uint64_t segments, std::uint64_t lost) {
  return lost > 0 && segments > lost;
}

}  // namespace

bool CongestionChoice::is_due(TimePoint now) const {
  return !asked_at_ || now - *asked_at_ >= std::max(kLook, 2 * round_trip_);
}

void CongestionChoice::look(const TcpCounts& counts, TimePoint now) {
  // The kernel's counts have 32 bits and may wrap.
  if (!looks_.empty() && counts.segments < looks_.back().segments) looks_.clear();
  Look look{counts.segments, counts.lost, now};
  round_trip_ = counts.round_trip;
  // The kernel may find out later that a repeated segment had arrived, and lower its count.
  if (!looks_.empty()) look.lost = std::max(look.lost, looks_.back().lost);
  looks_.push_back(look);
  const auto is_too_old = [&] {
    const Look& next = looks_[1];
    return now - next.at >= kTogetherMost ||
           (now - next.at >= kTogether && counts.segments - next.segments >= kSegments);
  };
  while (looks_.size() > 2 && is_too_old()) looks_.pop_front();
}

bool CongestionChoice::loses() const {
  const Look& first = looks_.front();
  const Look& last = looks_.back();
  const auto segments = last.segments - first.segments;
  const auto lost = last.lost - first.lost;
  if (segments < kSegments || lost < kLostMin || 1000 * lost < kLostPerMille * segments)
    return false;
  int times = 0;
  for (std::size_t i = 1; i < looks_.size(); ++i)
    if (loses_of_new(looks_[i].segments - looks_[i - 1].segments,
                     looks_[i].lost - looks_[i - 1].lost))
      ++times;
  return times >= kTimes;
}

std::optional<std::string_view> CongestionChoice::next(const TcpCounts& counts, TimePoint now) {
  asked_at_ = now;
  const auto before = chosen_;
  look(counts, now);
  if (loses()) {
    lost_at_ = now;
    chosen_ = kWithLosses;
  } else if (now - lost_at_ >= kCalm) {
    chosen_ = kFirst;
  }
  return chosen_ == before ? std::nullopt : std::optional(chosen_);
}

}  // namespace connect_bridge
