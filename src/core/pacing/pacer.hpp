// How fast what is not urgent may leave: as fast as the path delivers and no faster, so that the
// queues on the way stay short. docs/flow.md explains the idea and where it comes from.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/time.hpp"
#include "core/pacing/path.hpp"
#include "core/pacing/path_share.hpp"

namespace connect_bridge {

// Belongs to one connection. Counts are bytes of binary packets since the connection opened.
class Pacer {
 public:
  // `target`: the queueing delay on the path that data which is not urgent may cause; zero: nothing
  // is held back.
  explicit Pacer(Duration target) : target_(target) {}

  // When data that is not urgent may leave: now or later; kNever: not before the next
  // acknowledgement.
  [[nodiscard]] TimePoint next_at(TimePoint now) const;
  static constexpr TimePoint kNever = TimePoint::max();

  // Call it before next_at().
  void repairs(const Repairs& counted) { path_.repairs(counted); }

  // Whether data is under way, or was cut short: then repairs() matters even if none waits.
  [[nodiscard]] bool measures() const { return !path_.idle(); }

  // Whether a packet with data that is about to leave should ask for an acknowledgement at once.
  [[nodiscard]] bool wants_ack(std::size_t bytes, bool more_waits, TimePoint now) const;
  void sent(const SentPacket& packet);
  void acknowledged(const Arrival& ack, TimePoint now);

  // A part that takes about a 24th of a round trip on the wire, 1 to 4 ms, at most `most` bytes: in
  // full segments, where it is not much less than one.
  [[nodiscard]] std::uint32_t part_bytes(std::uint32_t most) const;
  // How much may wait in the kernel.
  [[nodiscard]] std::uint32_t unsent_bytes() const;

  // Estimated bytes per second that the path carries: until a rate is measured, what a new
  // connection may send at once. 0: not known, or the round trip is very short.
  [[nodiscard]] double assumed_rate() const;

  // ---- for people and tests
  // Bytes per second that the path carries; 0: not known yet.
  [[nodiscard]] double rate() const { return path_.delivery(); }
  [[nodiscard]] Duration queue() const { return path_.queue(); }

  static constexpr std::uint32_t kUnknownPartBytes = 16384;  // while the rate is not known

 private:
  void end_round(bool limited);
  void judge_queue(TimePoint now);
  // Whether the queue has been too long for longer than one of our own would be.
  [[nodiscard]] bool queue_stays(Duration queue, TimePoint now);
  // From now on the queue counts as the path's delay.
  void take_as_delay(TimePoint now);
  void drain(TimePoint now);
  [[nodiscard]] bool burst_fills(Duration queue) const;
  [[nodiscard]] bool is_too_long(Duration queue) const;
  [[nodiscard]] PathShare::Round share_round(bool tcp_limits) const;
  [[nodiscard]] double in_segments(double bytes) const;
  [[nodiscard]] double gain() const;
  [[nodiscard]] Duration ask_period() const;
  [[nodiscard]] double target() const { return target(path_.delivery()); }
  [[nodiscard]] double target(double rate) const { return target(rate, target_); }
  [[nodiscard]] double target(double rate, Duration least) const;
  [[nodiscard]] double aim() const;
  [[nodiscard]] double carries() const;
  [[nodiscard]] double least_rate() const;
  [[nodiscard]] std::uint64_t window() const;
  // Acknowledgements are overdue: the path has become slower or has stopped.
  [[nodiscard]] bool acks_are_late(TimePoint now) const;

  Duration target_;
  Path path_;
  bool starting_ = true;
  // Nothing leaves until this byte count is acknowledged, to see the path empty.
  std::uint64_t drain_end_ = 0;
  double trim_ = 0;       // correction of the measured rate that the control has learnt
  double boost_ = 0;      // extra rate, which grows while nothing queues
  double variation_ = 0;  // how much the rate changes from round to round, on average, as a share
  std::uint64_t round_end_ = 0;  // a round of the control ends when these are acknowledged
  double round_delivery_ = 0;    // of the path when the last one ended
  bool round_limited_ = false;   // in this round the traffic, not the path, limited the rate
  bool last_limited_ = false;    // and in the one before
  double before_burst_ = 0;      // delivery rate of the path when little was last on its way
  struct Episode {
    TimePoint since{};
    Duration queue{};
  };
  // Since when the queue has been too long, and has not fallen below half of its longest; and that
  // longest.
  Episode full_;
  TimePoint empty_at_{};  // when the path was last seen nearly empty
  PathShare share_;
  bool base_is_seen_ = true;  // the path was empty when its delay was measured
  double rate_ = 0;           // bytes per second at which packets leave; 0: not known
  TimePoint free_at_{};       // when what has left is paid for
};

}  // namespace connect_bridge
