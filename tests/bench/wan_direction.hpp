// One direction of a wide-area network: a queue that drops frames when it is full, a rate, a delay.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "wan_drive.hpp"

namespace bench {

struct Shape {
  double bits_per_second = 0;  // 0: no limit
  std::int64_t delay_ns = 0;
  std::int64_t jitter_ns = 0;  // up to this is added to the delay of each frame; no frame overtakes
  double loss = 0;             // 0 to 1
  std::int64_t queue_bytes = 1'000'000;
};

struct Count {
  std::uint64_t carried_bytes = 0, lost = 0, overflowed = 0;
  double possible_bytes = 0;  // what the rate allowed in that time
};

class Direction {
 public:
  using Frame = std::vector<std::uint8_t>;

  explicit Direction(std::uint64_t seed) : random_(seed) {}

  void set(const Shape& shape) {
    shape_ = shape;
    drive_.reset();
  }
  // The rate is that of a drive which begins now.
  void follow(Drive drive, std::int64_t now) {
    drive_ = std::move(drive);
    drive_began_ = now;
  }
  void cut(bool is_cut) {
    cut_ = is_cut;
    if (!is_cut) return;
    waiting_.clear();
    flying_.clear();
    waiting_bytes_ = 0;
  }

  void take(const std::uint8_t* data, std::size_t size, std::int64_t now) {
    step(now);
    const auto bytes = static_cast<std::int64_t>(size);
    if (cut_ || chance() < shape_.loss) {
      ++count_.lost;
    } else if (waiting_bytes_ + bytes > shape_.queue_bytes) {
      ++count_.overflowed;
    } else {
      waiting_bytes_ += bytes;
      waiting_.emplace_back(data, data + size);
      if (waiting_.size() == 1) sent_at_ = sent_after(std::max(now, sent_at_), bytes);
    }
  }

  // When something happens next.
  [[nodiscard]] std::int64_t due() const {
    auto when = std::numeric_limits<std::int64_t>::max();
    if (!waiting_.empty()) when = sent_at_;
    if (!flying_.empty()) when = std::min(when, flying_.front().due);
    return when;
  }

  // A frame that has arrived.
  std::optional<Frame> give(std::int64_t now) {
    step(now);
    if (flying_.empty() || flying_.front().due > now) return std::nullopt;
    Frame frame = std::move(flying_.front().frame);
    flying_.pop_front();
    return frame;
  }

  // The counts since the last call.
  Count count(std::int64_t now) {
    const auto step = drive_ ? drive_->step() : now - counted_from_;
    for (auto t = counted_from_; t < now; t += step) {
      const auto part = std::min(step, now - t);
      count_.possible_bytes += rate(t) * static_cast<double>(part) / 8e9;
    }
    counted_from_ = now;
    return std::exchange(count_, Count{});
  }
  void count_from(std::int64_t now) { counted_from_ = now; }

 private:
  struct Flying {
    std::int64_t due;
    Frame frame;
  };
  static constexpr std::int64_t kOnTheWire = 24;  // preamble, checksum and gap of Ethernet

  double rate(std::int64_t now) {
    return drive_ ? drive_->at(now - drive_began_) : shape_.bits_per_second;
  }
  double chance() { return std::uniform_real_distribution<double>(0, 1)(random_); }

  // When the last bit has left, if the first leaves at `from`.
  std::int64_t sent_after(std::int64_t from, std::int64_t bytes) {
    double bits = static_cast<double>(bytes + kOnTheWire) * 8;
    if (!drive_) {
      const double r = shape_.bits_per_second;
      return r > 0 ? from + static_cast<std::int64_t>(bits * 1e9 / r) : from;
    }
    for (;;) {
      const auto since = from - drive_began_;
      const auto left = drive_->step() - since % drive_->step();
      const double r = drive_->at(since);
      if (bits * 1e9 <= r * static_cast<double>(left)) {
        return from + static_cast<std::int64_t>(bits * 1e9 / r);
      }
      bits -= r * static_cast<double>(left) / 1e9;
      from += left;
    }
  }

  // Moves the frames that have left the queue by now onto the path.
  void step(std::int64_t now) {
    while (!waiting_.empty() && sent_at_ <= now) {
      auto due = sent_at_ + shape_.delay_ns;
      if (shape_.jitter_ns > 0) {
        due += static_cast<std::int64_t>(chance() * static_cast<double>(shape_.jitter_ns));
      }
      last_due_ = std::max(last_due_, due);
      const auto bytes = static_cast<std::int64_t>(waiting_.front().size());
      waiting_bytes_ -= bytes;
      count_.carried_bytes += static_cast<std::uint64_t>(bytes + kOnTheWire);
      flying_.push_back({last_due_, std::move(waiting_.front())});
      waiting_.pop_front();
      if (!waiting_.empty()) {
        sent_at_ = sent_after(sent_at_, static_cast<std::int64_t>(waiting_.front().size()));
      }
    }
  }

  Shape shape_;
  std::optional<Drive> drive_;
  std::int64_t drive_began_ = 0;
  bool cut_ = false;
  std::mt19937_64 random_;
  std::deque<Frame> waiting_;  // the first is being sent
  std::int64_t waiting_bytes_ = 0;
  std::int64_t sent_at_ = 0;  // when the first will have been sent
  std::deque<Flying> flying_;
  std::int64_t last_due_ = 0;
  std::int64_t counted_from_ = 0;
  Count count_;
};

}  // namespace bench
