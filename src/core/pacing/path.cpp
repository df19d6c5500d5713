#include "core/pacing/path.hpp"

#include <algorithm>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

constexpr Duration kRateSpanMin = 10ms;
constexpr Duration kRateWindowMin = 100ms;
constexpr Duration kQueueLong = 10ms;
constexpr Duration kJitterMax = 25ms;  // more is a single event, not usual jitter
constexpr std::size_t kArrivalsMax = 512;
constexpr double kQueueMax = 60e9;  // nanoseconds; more is a clock that is wrong

Duration nanoseconds(double count) {
  return Duration(static_cast<std::int64_t>(count));
}

}  // namespace

Duration Path::round_trip() const {
  if (round_trip_.empty()) return kRoundTripUnknown;
  return std::max(nanoseconds(round_trip_.get()), kRoundTripMin);
}

void Path::sent(const SentPacket& packet) {
  if (idle()) {  // what was measured before the pause no longer counts
    arrivals_.clear();
    waited_.clear();
    waited_most_.clear();
    queue_ = {};
    long_since_.reset();
  }
  sent_bytes_ = packet.end;
  if (packet.asks) {
    asked_at_ = packet.at;
    asked_end_ = packet.end;
    asks_.push_back(packet.at);
  }
  if (!packet.more_waits) limited_end_ = packet.end;
  in_flight_bytes_ += packet.bytes;
  flight_.push_back(packet);
}

// Data sent before a segment was repeated may have to wait for that segment.
void Path::repairs(const Repairs& counted) {
  if (counted.open && counted.repeated != repairs_.repeated) repair_end_ = sent_bytes_;
  repairs_ = counted;
}

void Path::forget_base() {
  one_way_.clear();
  round_trip_.clear();
  waited_.clear();
  waited_most_.clear();
  queue_ = {};
  long_since_.reset();
  lateness_ = lateness_back_ = {};
}

std::optional<Path::Covered> Path::acknowledged(const Arrival& ack, TimePoint now) {
  acked_bytes_ = ack.received_bytes;
  std::optional<SentPacket> last;
  Covered covered;
  for (; !flight_.empty() && flight_.front().end <= ack.received_bytes; flight_.pop_front()) {
    last = flight_.front();
    in_flight_bytes_ -= last->bytes;
    if (last->asks) asks_.pop_front();
    covered.end = last->end;
    // One packet behind which nothing waited, and the time until the next one is the traffic's.
    covered.limited = covered.limited || last->end <= limited_end_;
  }
  if (!last) return std::nullopt;
  covered.behind_loss = waited_for_repair(covered.end, now);
  // The time in the acknowledgement belongs to the last byte, which may be that of a later packet
  // without data.
  if (last->end == ack.received_bytes && !covered.behind_loss) measure_delay(*last, ack, now);
  const bool stood = stood_end_ > 0;
  measure_rate(ack, covered, now);
  if (stood_end_ > 0 && ack.received_bytes >= stood_end_) {
    stood_end_ = 0;
    covered.recovered = stood;
  }
  return covered;
}

// If so much is lost that all data waits for repairs, waiting counts as normal: else a queue would
// never be seen.
bool Path::waited_for_repair(std::uint64_t end, TimePoint now) {
  const bool waited = end <= repair_end_;
  if (!waited) unhindered_at_ = now;
  return waited && now - unhindered_at_ < rate_window();
}

Duration Path::rate_window() const {
  return std::max(4 * round_trip(), kRateWindowMin);
}

// One way, by the peer's clock, so that what queues on the way back does not count.
void Path::measure_delay(const SentPacket& last, const Arrival& ack, TimePoint now) {
  const auto one_way =
      static_cast<double>(ack.at) - static_cast<double>(last.at.time_since_epoch().count());
  // The two clocks have begun anywhere, so only the difference to the shortest of these counts: it
  // is the path without a queue.
  one_way_.add(one_way, now, kBaseWindow);
  const double waited = one_way - one_way_.get();
  waited_now_ = waited;
  waited_.add(waited, now, 3 * round_trip() / 4);
  waited_most_.add(waited, now, round_trip());
  const Duration spread = nanoseconds(waited_most_.get() - waited_.get());
  jitter_ += (std::min(spread, kJitterMax) - jitter_) / 32;
  queue_ = nanoseconds(std::clamp(waited_.get(), 0.0, kQueueMax));
  if (queue_ <= std::max<Duration>(kQueueLong, 2 * jitter_)) {
    long_since_.reset();
  } else if (!long_since_) {
    long_since_ = now;
  }
  if (!last.asks) return;  // the peer acknowledges the others later, at a time of its own
  const Duration took = now - last.at;
  round_trip_.add(static_cast<double>(took.count()), now, kBaseWindow);
  const Duration late = took - nanoseconds(round_trip_.get());
  lateness_ += (late - lateness_) / 16;
  const Duration back = late - nanoseconds(std::clamp(waited, 0.0, kQueueMax));
  lateness_back_ += (back - lateness_back_) / 16;
}

// Nothing arrived for more than a round trip although data had been sent: TCP has repaired a loss,
// a cellular link was interrupted, or the rate has fallen.
bool Path::has_stood(const Arrival& ack) const {
  if (arrivals_.empty()) return false;
  const auto gap = static_cast<double>(ack.at - arrivals_.back().arrival.at);
  const auto least = static_cast<double>((round_trip() + kRateSpanMin).count());
  return gap > least && waited_now_ > gap / 2;
}

// A long queue stays only where the path limits what arrives, though nothing more may wait to be
// sent. Where little is on its way it is no queue of ours.
bool Path::queue_stays(TimePoint now) const {
  return long_since_ && now - *long_since_ > 2 * round_trip() &&
         in_flight_bytes_ >= kFirstBytes / 4;
}

// Measured between arrivals by the peer's clock, so that acknowledgements that come in a bunch do
// not look like a fast path.
void Path::measure_rate(const Arrival& ack, const Covered& covered, TimePoint now) {
  const auto span = std::max(round_trip() / 2, kRateSpanMin).count();
  if (has_stood(ack)) stood_end_ = sent_bytes_;
  // Data that arrives in a bunch, after the path stood still or behind a repeated segment, shows
  // the path's rate only if the time before is included.
  const bool bunch = (stood_end_ > 0 || covered.behind_loss) && arrivals_.size() > 1;
  if (bunch) {
    arrivals_.back() = {ack, covered.limited || arrivals_.back().limited};
  } else {
    arrivals_.push_back({ack, covered.limited});
  }
  // Otherwise a peer whose clock stands still would fill the memory.
  while (!bunch && arrivals_.size() > 2 &&
         (ack.at - arrivals_[1].arrival.at >= span || arrivals_.size() > kArrivalsMax))
    arrivals_.pop_front();
  const Arrival& first = arrivals_.front().arrival;
  const auto took = ack.at - first.at;
  if (took < span / 2 || covered.behind_loss) return;
  const double rate = static_cast<double>(ack.received_bytes - first.received_bytes) * 1e9 /
                      static_cast<double>(took);
  // After a limited arrival there was a pause.
  const bool any_limited = std::any_of(arrivals_.begin(), arrivals_.end(),
                                       [](const Counted& counted) { return counted.limited; });
  // Little traffic does not show what the path could carry.
  const double first_rate = kFirstBytes / std::chrono::duration<double>(round_trip()).count();
  if (any_limited && !queue_stays(now) && rate < std::max(delivery_.get(), first_rate)) return;
  // This one counts while the queue is too long, else the maximum (Pacer::carries).
  latest_delivery_ = rate;
  delivery_.add(rate, now, rate_window());
}

}  // namespace connect_bridge
