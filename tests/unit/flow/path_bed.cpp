#include "unit/flow/path_bed.hpp"

#include <algorithm>
#include <array>
#include <deque>
#include <map>
#include <optional>
#include <random>

#include "core/pacing/pacer.hpp"
#include "unit/flow/foreign_flow.hpp"

namespace connect_bridge::flow_test {
namespace {

using namespace std::chrono_literals;

constexpr Duration kStep = 20us;
constexpr std::uint32_t kHeaders = 64;  // of TCP and below, per packet
constexpr Stamp kClockOffset = 123'456'789;
constexpr Duration kUrgentPeriod = 20ms;
constexpr Duration kForeignQueue = 200ms;  // what does not fit is lost

struct BedPacket {
  std::uint32_t bytes = 0;
  std::uint32_t bulk = 0;
  std::optional<Duration> urgent;  // since when
  std::optional<Arrival> ack;
  bool asks = false;
};

class End {
 public:
  End(const BedDirection& out, Duration target) : out_(out), pacer_(target) {}

  void repairs(const Repairs& told) { pacer_.repairs(told); }

  void produce(Duration now) {
    if (out_.bulk_per_second > 0 && now >= std::max(next_bulk_, out_.bulk_from)) {
      next_bulk_ += Duration(static_cast<std::int64_t>(1e9 / out_.bulk_per_second));
      waiting_ = true;
      if (bulk_left_ == 0) begin_bulk();
    }
    if (now < next_urgent_) return;
    next_urgent_ += kUrgentPeriod;
    urgent_.push_back(now);
  }

  std::optional<BedPacket> pull(Duration now) {
    BedPacket packet;
    if (ack_at_ && *ack_at_ <= now) {
      ack_at_.reset();
      packet.ack = received_;
      packet.bytes = 24;
      sent_bytes_ += packet.bytes;
      return packet;
    }
    if (!urgent_.empty()) {
      packet.urgent = urgent_.front();
      urgent_.pop_front();
      packet.bytes = 56;
    } else if (bulk_left_ > 0 && pacer_.next_at(TimePoint(now)) <= TimePoint(now)) {
      packet.bulk = std::min(bulk_left_, pacer_.part_bytes(256 << 10));
      bulk_left_ -= packet.bulk;
      if (bulk_left_ == 0 && waiting_) begin_bulk();
      packet.bytes = packet.bulk + 12;
    } else {
      return std::nullopt;
    }
    const bool more_waits = bulk_left_ > 0;
    packet.asks = pacer_.wants_ack(packet.bytes, more_waits, TimePoint(now));
    sent_bytes_ += packet.bytes;
    pacer_.sent({sent_bytes_, packet.bytes, TimePoint(now), packet.asks, more_waits});
    return packet;
  }

  void arrive(const BedPacket& packet, Duration now) {
    received_ = {received_.received_bytes + packet.bytes, now.count() + kClockOffset};
    if (packet.ack) return pacer_.acknowledged(*packet.ack, TimePoint(now));
    if (packet.asks) {
      ack_at_ = now;
    } else if (!ack_at_) {
      ack_at_ = now + 100ms;
    }
  }

 private:
  void begin_bulk() {
    bulk_left_ = out_.bulk_bytes;
    waiting_ = false;
  }

  const BedDirection& out_;
  Pacer pacer_;
  std::deque<Duration> urgent_;
  std::uint32_t bulk_left_ = 0;
  bool waiting_ = false;
  Duration next_bulk_{};
  Duration next_urgent_{};
  std::uint64_t sent_bytes_ = 0;
  Arrival received_;
  std::optional<Duration> ack_at_;
};

// With losses it works as TCP with SACK: what comes behind a lost packet waits at the receiver, the
// sender knows of it as soon as the way back allows, and repeats the packet.
class Wire {
 public:
  Wire(const BedDirection& direction, Duration back) : direction_(direction), back_(back) {}

  void push(const BedPacket& packet) {
    pushed_bytes_ += packet.bytes;
    enqueue({next_++, packet});
  }

  // As the sender knows it.
  [[nodiscard]] Repairs repairs(Duration now) {
    for (; !known_.empty() && known_.front().at <= now; known_.pop_front()) {
      crossed_bytes_ += known_.front().bytes;
      waiting_ = known_.front().waiting;
    }
    return {waiting_, pushed_bytes_ - crossed_bytes_, repeated_, direction_.segment_bytes};
  }
  // As the receiver knows it.
  [[nodiscard]] bool misses() const { return !early_.empty(); }

  template <class Arrive>
  void step(Duration now, bool judged, const Arrive& arrive) {
    const double carries = direction_.rate(now) * std::chrono::duration<double>(kStep).count();
    if (judged) carried_ += carries;
    if (now >= direction_.foreign_from && now < direction_.foreign_to) push_foreign(now);
    for (; !repeats_.empty() && repeats_.front().at <= now; repeats_.pop_front()) {
      enqueue(repeats_.front().segment);
      ++repeated_;
    }
    credit_ = queue_.empty() ? carries : credit_ + carries;
    while (!queue_.empty() && credit_ >= queue_.front().packet.bytes + kHeaders) {
      const Segment segment = queue_.front();
      queue_.pop_front();
      queued_bytes_ -= segment.packet.bytes + kHeaders;
      if (is_lost()) {  // and is repeated as soon as the sender can know that
        repeats_.push_back({now + delay(now) + back_, segment});
        continue;
      }
      credit_ -= segment.packet.bytes + kHeaders;
      flying_.push_back({arrival(now + delay(now)), segment});
    }
    for (; !flying_.empty() && flying_.front().at <= now; flying_.pop_front()) {
      const Segment& segment = flying_.front().segment;
      if (segment.number == kForeign) {
        foreign_acks_.push_back(now + back_);
        continue;
      }
      early_.emplace(segment.number, segment.packet);
      for (; !early_.empty() && early_.begin()->first == awaited_; ++awaited_) {
        const BedPacket packet = early_.begin()->second;
        early_.erase(early_.begin());
        if (judged) bulk_ += packet.bulk;
        if (judged && packet.urgent)
          result_.waits.push_back({now, now - *packet.urgent - delay(now)});
        arrive(packet);
      }
      known_.push_back({now + back_, segment.packet.bytes, misses()});
    }
  }

  [[nodiscard]] Duration delay(Duration now) const {
    return direction_.delay + (now < direction_.detour_at ? Duration{} : direction_.detour);
  }

  BedResult result() {
    result_.bulk_share = bulk_ / carried_;
    return result_;
  }

 private:
  static constexpr std::uint64_t kForeign = ~0ULL;
  struct Segment {
    std::uint64_t number;  // or kForeign
    BedPacket packet;
  };
  struct Flying {
    Duration at;
    Segment segment;
  };
  struct Known {
    Duration at;
    std::uint64_t bytes;
    bool waiting;  // at the receiver, behind a lost one
  };
  void enqueue(const Segment& segment) {
    queue_.push_back(segment);
    queued_bytes_ += segment.packet.bytes + kHeaders;
  }
  void push_foreign(Duration now) {
    for (; !foreign_acks_.empty() && foreign_acks_.front() <= now; foreign_acks_.pop_front())
      foreign_.acknowledged();
    for (int left = foreign_.leaves(now); left > 0; --left) {
      const auto waits =
          Duration(static_cast<std::int64_t>(1e9 * queued_bytes_ / direction_.rate(now)));
      if (waits > kForeignQueue) {
        foreign_.lost(now, waits);
      } else {
        BedPacket packet;
        packet.bytes = ForeignFlow::kPacketBytes;
        enqueue({kForeign, packet});
      }
    }
  }
  [[nodiscard]] bool is_lost() {
    return direction_.loss > 0 &&
           std::uniform_real_distribution<double>(0, 1)(random_) < direction_.loss;
  }
  [[nodiscard]] Duration arrival(Duration at) {
    if (direction_.jitter > 0s) {
      std::exponential_distribution<double> draw(1 /
                                                 static_cast<double>(direction_.jitter.count()));
      last_ = std::max(last_, at + Duration(static_cast<std::int64_t>(draw(random_))));
      return last_;
    }
    return direction_.bunch > 0s ? (at / direction_.bunch + 1) * direction_.bunch : at;
  }

  const BedDirection& direction_;
  Duration back_;
  std::deque<Segment> queue_;
  double queued_bytes_ = 0;
  ForeignFlow foreign_;
  std::deque<Duration> foreign_acks_;  // when its sender has them
  std::deque<Flying> flying_;
  std::deque<Flying> repeats_;
  std::map<std::uint64_t, BedPacket> early_;  // arrived behind a lost one
  std::deque<Known> known_;                   // what arrived, and when the sender knows it
  std::uint64_t next_ = 0;
  std::uint64_t awaited_ = 0;
  std::uint64_t pushed_bytes_ = 0;
  std::uint64_t crossed_bytes_ = 0;
  std::uint64_t repeated_ = 0;
  bool waiting_ = false;
  std::mt19937_64 random_{1};
  Duration last_{};
  double credit_ = 0;
  double carried_ = 0;
  double bulk_ = 0;
  BedResult result_;
};

}  // namespace

double BedResult::percentile_ms(double share) const {
  std::vector<Duration> sorted;
  for (const Wait& one : waits) sorted.push_back(one.wait);
  std::sort(sorted.begin(), sorted.end());
  const auto at = std::min(sorted.size() - 1,
                           static_cast<std::size_t>(share * static_cast<double>(sorted.size())));
  return std::chrono::duration<double, std::milli>(sorted.at(at)).count();
}

double BedResult::worst_ms(Duration from, Duration to) const {
  Duration worst{};
  for (const Wait& one : waits)
    if (one.at >= from && one.at < to) worst = std::max(worst, one.wait);
  return std::chrono::duration<double, std::milli>(worst).count();
}

std::function<double(Duration)> megabits(double rate) {
  return [rate](Duration) { return rate * 1e6 / 8; };
}

BedOptions thin_link() {
  BedOptions options;
  options.there.rate = megabits(18);
  options.back.rate = megabits(58);
  options.there.bulk_per_second = 10;
  return options;
}

BedResults run_bed(const BedOptions& options) {
  std::array<End, 2> ends{End(options.there, options.target), End(options.back, options.target)};
  std::array<Wire, 2> wires{Wire(options.there, options.back.delay),
                            Wire(options.back, options.there.delay)};
  for (Duration now{}; now < options.lasts; now += kStep) {
    for (std::size_t i = 0; i < 2; ++i) {
      ends[i].produce(now);
      auto repairs = wires[i].repairs(now);
      repairs.open = repairs.open || wires[1 - i].misses();
      ends[i].repairs(repairs);
      while (const auto packet = ends[i].pull(now)) wires[i].push(*packet);
      wires[i].step(now, now >= options.warm_up,
                    [&](const BedPacket& packet) { ends[1 - i].arrive(packet, now); });
    }
  }
  return {wires[0].result(), wires[1].result()};
}

}  // namespace connect_bridge::flow_test
