#include "core/pacing/pacer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace connect_bridge {
namespace {

using namespace std::chrono_literals;

constexpr double kRateMax = 1e11;
constexpr std::uint64_t kWindowMin = 2048;
// Smaller parts would cost more in headers than they gain in delay.
constexpr std::uint32_t kPartBytesMin = 600;
// Overhead of a packet: a message's header, the request for an acknowledgement, WebSocket, TLS.
constexpr std::uint32_t kFramingBytes = 88;
constexpr std::uint32_t kUnsentBytesMin = 3 * 1460;  // full segments
// On so fast a path the processors at its ends cause the delay, not the path. The same holds for so
// short a path while its rate is not known: what is sent at once arrives soon.
constexpr double kFastRate = 100e6;  // bytes per second
constexpr Duration kNear = 2ms;      // round trip
constexpr double kNearFirstBytes = 512 << 10;
constexpr std::uint32_t kNearPartBytes = 130000;  // with headers two writes of 64 KiB
constexpr Duration kCredit = 1ms;                 // what may be caught up after a late wake-up
constexpr Duration kLateMax = 300ms;              // of acknowledgements, on their way
constexpr Duration kDebtMax = 100ms;              // by urgent data, which is never held back
constexpr double kMoreArrives = 1.25;             // clearly more
constexpr double kTrimMin = -0.15;
constexpr double kBoostFirst = 0.03;
constexpr double kBoostFirstMax = 0.2;
constexpr double kBoostMax = 1;
constexpr Duration kEmptyPeriod = 5s;
constexpr Duration kLonePeriod = 1s;

double seconds(Duration time) {
  return std::chrono::duration<double>(time).count();
}

// A peer's clock may report any time, so it is bounded.
Duration from_seconds(double time) {
  const std::chrono::duration<double> bounded(std::clamp(time, -3600.0, 3600.0));
  return std::chrono::duration_cast<Duration>(bounded);
}

}  // namespace

// ---- what may leave

TimePoint Pacer::next_at(TimePoint now) const {
  if (target_ <= Duration::zero()) return now;
  // In this order: to see the path empty is for a moment only, and lasts until what is under way
  // has arrived; on a fast path nothing else is held back; then the window, and the rate last.
  if (path_.acked_bytes() < drain_end_) return kNever;
  if (path_.delivery() >= kFastRate) return now;
  // While TCP repairs a loss no acknowledgement of ours shows what arrives, so TCP is asked again
  // soon; else later, as a loss may be why none comes.
  if (path_.in_flight_bytes() >= window() || acks_are_late(now)) {  // mutant: in_flight
    const Duration again = std::max(path_.round_trip(), ask_period());
    return now + (path_.is_repaired() ? ask_period() : again);
  }
  return rate_ == 0 ? now : free_at_;  // mutant: rate
}

// The bytes that the path carries in a round trip, plus a little. When the path becomes slower, the
// window stops the sender before a new rate is measured.
std::uint64_t Pacer::window() const {
  const bool near = path_.round_trip() < kNear;
  if (rate_ == 0) return static_cast<std::uint64_t>(near ? kNearFirstBytes : Path::kFirstBytes);
  const Duration round = path_.round_trip();
  // A queue of our own makes acknowledgements late, too: lateness above a round trip counts only as
  // far as the acknowledgements have waited themselves.
  const Duration back = std::min(path_.lateness_back(), kLateMax);
  const Duration late = std::min(3 * path_.lateness() / 4, std::max(round, back));
  const Duration slack = starting_ ? round : 2 * target_ + late;
  const double least = starting_ ? Path::kFirstBytes : static_cast<double>(kWindowMin);
  const double time = seconds(round + slack + ask_period());
  const double share = share_.rate() * (time + seconds(path_.queue()));
  // The least rate is no measure of what the path carries.
  const double rate = rate_ > least_rate() ? std::max(carries(), rate_ / 2) : carries();
  return static_cast<std::uint64_t>(std::max({rate * time, share, least}));
}

bool Pacer::acks_are_late(TimePoint now) const {
  const auto since = path_.waits_since();
  if (starting_ || !since || path_.is_repaired()) return false;
  return now - *since > path_.round_trip() + ask_period() + 2 * target_ + 3 * path_.lateness();
}

// A single small message gives little information; its acknowledgement comes without being asked
// for.
bool Pacer::wants_ack(std::size_t bytes, bool more_waits, TimePoint now) const {
  if (target_ <= Duration::zero()) return false;
  const bool alone = !more_waits && path_.in_flight_bytes() + bytes < kUnknownPartBytes;
  if (alone) return now - path_.asked_at() >= kLonePeriod;
  return !more_waits || now - path_.asked_at() >= ask_period() ||
         path_.bytes_since_asked() >= window() / 4;
}

Duration Pacer::ask_period() const {
  return std::clamp<Duration>(path_.round_trip() / 8, 2ms, 10ms);
}

std::uint32_t Pacer::part_bytes(std::uint32_t most) const {
  if (target_ <= Duration::zero()) return most;
  if (rate_ == 0)
    return std::min(path_.round_trip() < kNear ? kNearPartBytes : kUnknownPartBytes, most);
  const double time = std::clamp(seconds(path_.round_trip()) / 24, 0.001, 0.004);
  const double bytes = std::max<double>(path_.delivery() * time, kPartBytesMin);
  return static_cast<std::uint32_t>(
      std::min<double>(in_segments(std::min<double>(bytes, most)), most));
}

// Each packet begins a segment, and a small one costs as much in headers as a full one.
double Pacer::in_segments(double bytes) const {
  const double segment = path_.segment_bytes();
  if (segment <= kFramingBytes || bytes < 0.7 * segment) return bytes;
  return std::max(std::floor(bytes / segment), 1.0) * segment - kFramingBytes;
}

// TCP's window after losses counts segments: a small one costs as much as a full one.
std::uint32_t Pacer::unsent_bytes() const {
  return std::max(2 * part_bytes(kUnknownPartBytes), kUnsentBytesMin);
}

double Pacer::assumed_rate() const {
  if (path_.delivery() > 0) return path_.delivery();
  if (!path_.knows_round_trip() || path_.round_trip() < kNear) return 0;
  return Path::kFirstBytes / seconds(path_.round_trip());
}

void Pacer::sent(const SentPacket& packet) {
  // After a pause neither a queue nor its absence is known to have lasted.
  if (path_.idle()) {
    full_ = {packet.at, Duration::zero()};
    empty_at_ = packet.at;
    share_.pause(packet.at);
  }
  path_.sent(packet);
  if (rate_ == 0 || path_.delivery() >= kFastRate) return;
  const auto cost = from_seconds(packet.bytes / rate_);
  free_at_ = std::min(std::max(free_at_, packet.at - kCredit) + cost, packet.at + kDebtMax);
}

// ---- what is learnt

void Pacer::acknowledged(const Arrival& ack, TimePoint now) {
  // Something might have left for a while, and has not.
  const bool tcp_limits = next_at(now) <= now - kCredit;
  const auto covered = path_.acknowledged(ack, now);
  if (!covered || path_.delivery() == 0) return;
  if (covered->limited && path_.in_flight_bytes() < Path::kFirstBytes)
    before_burst_ = path_.delivery();
  judge_queue(now);
  if (covered->recovered) boost_ = kBoostMax;
  // Data that waited for a repair shows nothing about the queue.
  round_limited_ = round_limited_ || covered->limited || covered->behind_loss;
  // A round ends when all that was sent at its begin is acknowledged: by then what the last change
  // of the rate has done shows.
  if (covered->end >= round_end_) {
    end_round(round_limited_);
    if (round_limited_) {
      share_.pause(now);
    } else {
      share_.end_round(share_round(tcp_limits), now);
    }
    round_end_ = path_.sent_bytes();
    round_limited_ = false;
  }
  const double before = rate_;
  rate_ = std::clamp(std::max(gain() * carries(), share_.rate()), least_rate(), kRateMax);
  // The debt is in bytes, so its duration changes with the rate.
  const Duration owed = from_seconds(seconds(free_at_ - now) * before / rate_);
  if (free_at_ > now) free_at_ = now + std::min(owed, kDebtMax);
}

void Pacer::judge_queue(TimePoint now) {
  const Duration queue = path_.queue();
  const Duration target = from_seconds(this->target());
  share_.queue_is(queue);
  if (starting_ || queue > 4 * target || trim_ < kTrimMin / 2) share_.path_is_not_seen(now);
  if (queue > std::max(2 * target, path_.round_trip()) || burst_fills(queue)) starting_ = false;
  if (queue > target / 2) boost_ = 0;
  if (queue <= target && base_is_seen_) empty_at_ = now;
  if (queue_stays(queue, now)) take_as_delay(now);
  if (now - empty_at_ > kEmptyPeriod) drain(now);
}

// Our own queue disappears soon after we send less.
bool Pacer::queue_stays(Duration queue, TimePoint now) {
  if (!is_too_long(queue)) {
    full_ = {now, Duration::zero()};
    return false;
  }
  // The queue has shrunk by half, as a queue of our own does soon after less is sent.
  if (queue < full_.queue / 2) full_ = {now, Duration::zero()};
  full_.queue = std::max(full_.queue, queue);
  const Duration rounds =
      std::max(3 * path_.round_trip(), std::min<Duration>(10 * path_.round_trip(), 500ms));
  return now - full_.since > 2 * full_.queue + rounds;
}

// A delay that stays is the path itself, which has become longer (another cell, another route), or
// a queue of somebody else, which holding back would not shorten.
void Pacer::take_as_delay(TimePoint now) {
  share_.begin(share_round(false), now);
  path_.forget_base();
  base_is_seen_ = false;
  empty_at_ = now;
  full_ = {now, Duration::zero()};
}

// The shortest measured delay may contain a queue: from time to time the path must be seen empty.
void Pacer::drain(TimePoint now) {
  drain_end_ = path_.sent_bytes();
  base_is_seen_ = true;
  empty_at_ = now;
}

// More than before leaves and queues, and no more arrives: that is the path's rate. A burst that
// fits ends before a round with nothing but it in it could show that.
bool Pacer::burst_fills(Duration queue) const {
  return path_.in_flight_bytes() >= Path::kFirstBytes &&
         queue > 2 * from_seconds(target()) + path_.jitter() &&
         path_.latest_delivery() <= kMoreArrives * before_burst_;
}

bool Pacer::is_too_long(Duration queue) const {
  // While next to nothing leaves, arrivals show no rate, and the target would be too long.
  if (queue > 4 * from_seconds(target(std::max(share_.best() / 16, path_.delivery())))) return true;
  // To hold back does not help, though more than the least leaves.
  return queue > 2 * from_seconds(target()) && trim_ <= kTrimMin && rate_ > least_rate();
}

void Pacer::end_round(bool limited) {
  const bool burst_begins = std::exchange(last_limited_, limited);
  if (limited) return;
  const double error = (aim() - seconds(path_.queue())) / target();
  const double now = path_.delivery();
  const double before = std::exchange(round_delivery_, now);
  if (starting_) {
    // A delay alone may come from the path itself; the limit is reached where sending more does not
    // deliver more.
    starting_ = error > -1 || now > kMoreArrives * before;
    return;
  }
  // The queue of a burst has yet to come.
  if (burst_begins && error > 0) return;
  variation_ += (std::abs(now - before) / std::max(now, before) - variation_) / 16;
  // Slow: this learns over many rounds by how much the measured rate is wrong, while gain() answers
  // the queue of the moment (docs/flow.md section 3).
  trim_ = std::clamp(trim_ + 0.02 * std::clamp(error, -1.5, 1.0), kTrimMin, 0.05);
  if (error <= 0.5) return;
  // A rate that varies much is often far below what the path can carry.
  const double first = std::clamp(2 * variation_, kBoostFirst, kBoostFirstMax);
  boost_ = std::clamp(1.8 * boost_, first, kBoostMax);
}

PathShare::Round Pacer::share_round(bool tcp_limits) const {
  return {.delivery = path_.delivery(),
          .arrived_bytes = path_.acked_bytes(),
          .allowed = rate_,
          .without = gain() * carries(),
          .gain = gain(),
          .tcp_limits = tcp_limits,
          .starting = starting_,
          .queue = path_.queue(),
          .answer = 2 * (path_.round_trip() + path_.queue()) + ask_period()};
}

// Below this rate the window alone limits sending, and its acknowledgements show whether more is
// possible.
double Pacer::least_rate() const {
  return kWindowMin / seconds(path_.round_trip());
}

double Pacer::gain() const {
  if (starting_) return 2;
  const double missing = aim() - seconds(path_.queue());
  const double loop = seconds(path_.round_trip()) + 0.005;  // how late its acknowledgement comes
  // A stronger answer would oscillate, as its effect is seen a round trip late (docs/flow.md
  // section 3).
  return 1 + trim_ + boost_ + std::clamp(0.3 * missing / loop, -0.5, 0.1);
}

// A part's own time on the wire counts as well. And where the delay varies without our doing,
// holding back would not shorten it.
double Pacer::target(double rate, Duration least) const {
  return std::max(
      {seconds(least), 1.5 * part_bytes(kNearPartBytes) / rate, 0.4 * seconds(path_.jitter())});
}

// The queue that is aimed at: on a short path less than what is tolerated, as it would be much
// beside the round trip.
double Pacer::aim() const {
  if (path_.is_repaired()) return target();
  const Duration share = std::clamp<Duration>(path_.round_trip() / 16, 5 * target_ / 8, target_);
  return target(path_.delivery(), share);
}

// While the queue is too long, the last measured rate is used, otherwise the best of a few round
// trips.
double Pacer::carries() const {
  const double most = path_.delivery();
  return seconds(path_.queue()) > 3 * target() ? std::min(path_.latest_delivery(), most) : most;
}

}  // namespace connect_bridge
