#include "core/link/side_cap.hpp"

#include <limits>
#include <map>

#include "core/flow/link_cap.hpp"

namespace connect_bridge {
namespace {

constexpr double kAll = std::numeric_limits<double>::infinity();

// A shorter period says nothing about a link's rate.
constexpr Duration kShortest = std::chrono::milliseconds(10);

double seconds(Duration time) {
  return std::chrono::duration<double>(time).count();
}

}  // namespace

double fair_level(double amount, std::vector<double> wanted) {
  std::sort(wanted.begin(), wanted.end());
  double left = amount;
  auto others = static_cast<double>(wanted.size());
  for (const double each : wanted) {
    if (each * others >= left) return left / others;
    left -= each;
    --others;
  }
  // Nobody wants more: whoever begins to send first may have all.
  return amount;
}

SideCap::SideCap(std::uint64_t bytes_per_second) : rate_(LinkCap(bytes_per_second).rate()) {}

void SideCap::set(std::uint64_t bytes_per_second) {
  if (!limits()) {
    owed_ = known_ = 0;
    counted_.reset();
    ends_.reset();
  }
  rate_ = SideCap(bytes_per_second).rate_;
}

void SideCap::sent(TimePoint now, std::uint64_t bytes) {
  if (!limits()) return;
  if (!ends_) begin(now);
  in_period_ += bytes;
  if (static_cast<double>(in_period_) > rate_ * seconds(kPeriod))
    ends_ = std::min(*ends_, std::max(now, began_ + kShortest));
}

void SideCap::owe(double bytes) {
  // Links send whole messages, so one period has more than its bytes and the next one fewer.
  owed_ =
      std::clamp(owed_ + bytes, -rate_ * seconds(kPaidBack), rate_ * seconds(LinkCap::kDebtMax));
}

void SideCap::counted(std::uint64_t sent_bytes, TimePoint now) {
  if (!limits()) return;
  of_others_ = std::min(of_others_ + kOfOthers * rate_ * seconds(now - counted_at_),
                        kOfOthers * rate_ * seconds(LinkCap::kDebtMax));
  if (counted_ && sent_bytes > *counted_) {
    const double more = std::min(static_cast<double>(sent_bytes - *counted_) - known_, of_others_);
    if (more > 0) {
      of_others_ -= more;
      owe(more);
      sent(now, 0);
    }
  }
  counted_ = sent_bytes;
  counted_at_ = now;
  known_ = 0;
}

std::vector<double> SideCap::divide(const std::vector<Use>& links, TimePoint now) {
  const Duration passed = ends_ ? now - began_ : Duration::zero();
  const double took = seconds(std::max(passed, kShortest));
  double sum = 0;
  bool waits = false;
  std::map<const void*, std::vector<double>> wanted;
  for (const Use& link : links) {
    const auto sent = static_cast<double>(link.sent);
    sum += sent;
    waits |= link.waits;
    wanted[link.identity].push_back(link.waits ? kAll : sent / took);
  }
  known_ += sum;
  owe(sum - rate_ * seconds(passed));
  const double amount = std::max(rate_ - owed_ / seconds(kPaidBack), rate_ * kLeast);
  std::vector<double> of_identities;
  for (const auto& [identity, its] : wanted) {
    double all = 0;
    for (const double each : its) all += each;
    of_identities.push_back(all);
  }
  const double level = fair_level(amount, std::move(of_identities));
  std::map<const void*, double> levels;
  for (auto& [identity, its] : wanted) levels[identity] = fair_level(level, std::move(its));
  std::vector<double> rates;
  rates.reserve(links.size());
  for (const Use& link : links) rates.push_back(levels.at(link.identity));
  ends_.reset();
  if (limits() && (sum > 0 || owed_ > 0 || waits)) {
    begin(now);
  } else {
    owed_ = 0;  // a pause saves nothing up
  }
  return rates;
}

}  // namespace connect_bridge
