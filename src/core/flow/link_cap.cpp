#include "core/flow/link_cap.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kWebSocketHeader = 14;  // RFC 6455 section 5.2: a masked one, at the most
constexpr std::size_t kTlsRecord = 22;        // RFC 8446 section 5.2: header, type, AES-GCM's tag
constexpr std::size_t kTlsRecordBytes = 16384;
constexpr std::size_t kSegmentHeader = 72;   // IPv6, TCP with time stamps
constexpr std::size_t kSegmentBytes = 1428;  // of a packet of 1500
constexpr std::size_t kSegmentsPerAck = 2;   // RFC 1122 section 4.2.3.2
constexpr double kPartSeconds = 0.05;

std::size_t pieces(std::size_t bytes, std::size_t size) {
  return bytes / size + 1;
}

// A clock's type cannot hold any price.
template <class Period>
Duration at_most_debt(const std::chrono::duration<double, Period>& price) {
  return std::chrono::duration_cast<Duration>(
      std::min<std::chrono::duration<double>>(price, LinkCap::kDebtMax));
}

}  // namespace

std::uint64_t LinkCap::cost(std::size_t bytes) {
  const std::size_t framed = bytes + kWebSocketHeader;
  const std::size_t sealed = framed + kTlsRecord * pieces(framed, kTlsRecordBytes);
  return sealed + kSegmentHeader * pieces(sealed, kSegmentBytes);
}

std::uint32_t LinkCap::part_bytes(std::uint32_t most) const {
  if (rate_ == 0) return most;
  // While a part is paid for, urgent messages go on but everything else waits.
  const double fitting = std::max<double>(rate_ * kPartSeconds, kSegmentBytes);
  return static_cast<std::uint32_t>(std::min<double>(fitting, most));
}

void LinkCap::received(std::size_t bytes, TimePoint now) {
  // Received bytes cost nothing, but TCP's acknowledgements of them are sent.
  charge(kSegmentHeader * pieces(bytes, kSegmentsPerAck * kSegmentBytes), now);
}

void LinkCap::set_rate(double bytes_per_second, TimePoint now) {
  if (bytes_per_second == rate_) return;
  if (bytes_per_second == 0)
    paid_ = {};
  else if (rate_ != 0 && holds(now))
    paid_ = now + at_most_debt((paid_ - now) * (rate_ / bytes_per_second));
  rate_ = bytes_per_second;
}

void LinkCap::charge(std::uint64_t bytes, TimePoint now) {
  sent_ += bytes;
  if (rate_ == 0) return;
  const std::chrono::duration<double> price(static_cast<double>(bytes) / rate_);
  const Duration took = at_most_debt(price);
  // A pause saves up no more than kBurst; urgent data may run into debt, which is forgotten beyond
  // kDebtMax, or a flood of it would silence all else long after its end.
  paid_ = std::min(std::max(paid_, now - kBurst) + took, now + kDebtMax);
}

}  // namespace connect_bridge
