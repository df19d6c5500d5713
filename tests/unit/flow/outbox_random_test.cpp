// Random operations, seeded: an outbox's counts must add up, and its messages must arrive complete
// and in order.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <deque>
#include <map>
#include <random>
#include <set>

#include "core/flow/outbox.hpp"
#include "core/flow/reassembly.hpp"
#include "unit/flow/script.hpp"

namespace connect_bridge::flow_test {
namespace {

// A body that carries its number at the front and can be checked to the last byte.
Bytes body_of(std::uint64_t number, std::size_t size) {
  Bytes body(size);
  for (std::size_t i = 0; i < size; ++i) body[i] = static_cast<std::uint8_t>(number * 31 + i * 7);
  std::memcpy(body.data(), &number, sizeof number);
  return body;
}

class Scenario {
 public:
  explicit Scenario(std::uint64_t seed)
      : random_(seed), options_(random_options()), outbox_(options_) {}

  void run(int steps) {
    for (int step = 0; step < steps && !::testing::Test::HasFailure(); ++step) {
      time_ms_ += pick(3);
      act(pick(100));
      check();
    }
    if (::testing::Test::HasFailure()) return;
    // Everything that is accepted leaves in the end.
    for (int i = 0; i < 100'000 && outbox_.data_bytes() > 0; ++i) {
      send();
      acknowledge(received_bytes_);
    }
    while (outbox_.kept_bytes() > 0) {
      send();
      acknowledge(received_bytes_);
    }
    acknowledge(received_bytes_);
    check();
    EXPECT_EQ(outbox_.data_bytes(), 0U);
    EXPECT_TRUE(undelivered_.empty());
  }

 private:
  struct Channel {
    QueueOptions options;
    std::uint64_t accepted = 0;
    std::uint64_t arrived = 0;
    std::uint64_t last_number = 0;
  };
  struct Whole {
    std::uint64_t end = 0;  // bytes that had arrived with its last part
    ChannelId channel;
    std::uint64_t number = 0;
  };

  std::uint64_t pick(std::uint64_t n) { return random_() % n; }

  OutboxOptions random_options() {
    OutboxOptions options;
    options.fragment_bytes = static_cast<std::uint32_t>(1 + pick(3000));
    options.packet_bytes = static_cast<std::uint32_t>(pick(4000));
    options.unacknowledged_bytes_max = 5000 + pick(20'000);
    options.data_bytes_max = 10'000 + pick(30'000);
    return options;
  }

  void act(std::uint64_t dice) {
    if (dice < 45) return push();
    if (dice < 75) return send();
    if (dice < 88) return acknowledge();
    if (dice < 92) return add();
    if (dice < 94) return clear();
    if (dice < 96) return remove();
    outbox_.push_small(AckFrame{received_bytes_});
  }

  ChannelId some_channel() {
    auto at = channels_.begin();
    std::advance(at, static_cast<std::ptrdiff_t>(pick(channels_.size())));
    return at->first;
  }

  void add() {
    if (channels_.size() >= 8) return;
    QueueOptions options;
    options.priority = static_cast<Priority>(pick(kPriorities));
    options.depth = static_cast<std::uint32_t>(pick(6));
    options.queue_bytes_max = 1000 + pick(10'000);
    options.newest_only = pick(8) == 0;
    options.keep = !options.newest_only && pick(4) == 0;
    if (!options.keep && pick(3) == 0) options.max_age = std::chrono::milliseconds(pick(20));
    const ChannelId channel{++last_channel_};
    outbox_.add_channel(channel, options);
    channels_[channel].options = options;
  }

  void push() {
    if (channels_.empty()) return;
    const auto channel = some_channel();
    OutMessage out;
    out.subject = OriginId{static_cast<std::uint32_t>(numbers_ + 1)};
    out.tracked = channels_[channel].options.keep || pick(3) == 0;
    if (out.tracked) tracked_.insert(numbers_ + 1);
    out.stamp = pick(4) == 0 ? 0
                             : at_ms(static_cast<std::int64_t>(
                                   time_ms_ - std::min<std::uint64_t>(pick(10), time_ms_)));
    out.body = Payload::adopt(body_of(++numbers_, 8 + pick(pick(10) == 0 ? 9000 : 600)));
    outbox_.push(channel, std::move(out), now());
    ++channels_[channel].accepted;
  }

  void send() {
    const auto packet = outbox_.next(now());
    if (!packet) return;
    if (packet->text) {
      const auto bytes = joined(*packet);
      streams_.erase(ChannelId{
          static_cast<std::uint32_t>(std::stoul(std::string(bytes.begin(), bytes.end())))});
      return;
    }
    const auto whole = Payload::adopt(joined(*packet));
    received_bytes_ += whole.size();
    FrameReader reader(whole.view());
    while (true) {
      const auto frame = reader.next();
      ASSERT_TRUE(frame) << frame.error().message;
      if (!frame.value()) return;
      if (const auto* first = std::get_if<MessageFrame>(&*frame.value())) {
        arrive(receiver_.on_message(streams_[first->channel], *first, whole));
      } else if (const auto* part = std::get_if<PartFrame>(&*frame.value())) {
        arrive(receiver_.on_part(streams_[part->channel], *part));
      }
    }
  }

  void arrive(const Result<std::optional<InMessage>>& result) {
    ASSERT_TRUE(result) << result.error().message;
    if (!result.value()) return;
    const auto& message = *result.value();
    ASSERT_TRUE(channels_.contains(message.channel));
    auto& channel = channels_[message.channel];
    std::uint64_t number = 0;
    std::memcpy(&number, message.body.view().data(), sizeof number);
    EXPECT_GT(number, channel.last_number) << "order of channel " << message.channel.value;
    channel.last_number = number;
    ++channel.arrived;
    if (tracked_.contains(number))
      undelivered_.push_back({received_bytes_, message.channel, number});
    EXPECT_TRUE(std::ranges::equal(message.body.view(), body_of(number, message.body.size())));
  }

  void acknowledge() {
    const auto unknown = outbox_.unacknowledged_bytes();
    acknowledge(received_bytes_ - pick(unknown + 1));
  }

  // What has arrived by then, and only that, is delivered: once and in order.
  void acknowledge(std::uint64_t bytes) {
    const auto all = outbox_.acknowledge({bytes}, {});
    ASSERT_TRUE(all);
    for (const auto& delivered : *all) {
      ASSERT_FALSE(undelivered_.empty());
      EXPECT_EQ(delivered.subject.value, undelivered_.front().number);
      EXPECT_EQ(delivered.channel, undelivered_.front().channel);
      EXPECT_LE(undelivered_.front().end, bytes);
      undelivered_.pop_front();
    }
    if (undelivered_.empty()) return;
    EXPECT_GT(undelivered_.front().end, bytes);
  }

  void clear() {
    if (!channels_.empty()) outbox_.clear_channel(some_channel());
  }

  void remove() {
    if (channels_.empty()) return;
    const auto channel = some_channel();
    const auto last = outbox_.remove_channel(channel);
    expect_balance(last);
    EXPECT_EQ(last.queued + last.queued_bytes, 0U);
    channels_.erase(channel);
    ASSERT_TRUE(outbox_.push_control({std::to_string(channel.value)}));
  }

  void check() {
    std::uint64_t bytes = 0;
    std::uint64_t kept = 0;
    for (const auto& [id, channel] : channels_) {
      const auto counts = outbox_.counts(id);
      expect_balance(counts);
      const bool keeps = channel.options.keep;
      (keeps ? kept : bytes) += counts.queued_bytes;
      if (keeps) kept += counts.queued * kKeptMessageBytes;
      if (keeps) {
        EXPECT_EQ(counts.dropped.total(), counts.dropped.of(DropReason::kNoDemand));
      }
      EXPECT_EQ(counts.accepted, channel.accepted);
      EXPECT_EQ(counts.sent, channel.arrived);
      const bool one = channel.options.newest_only;
      const auto depth = one ? 1 : channel.options.depth;
      if (depth > 0 && !keeps) {
        EXPECT_LE(counts.queued, depth + 1U);
      }
    }
    EXPECT_EQ(outbox_.data_bytes(), bytes);
    EXPECT_EQ(outbox_.kept_bytes(), kept);
    EXPECT_LE(bytes, options_.data_bytes_max);
    // Acks alone may pass the reserve; there are few.
    EXPECT_LE(outbox_.unacknowledged_bytes(),
              options_.unacknowledged_bytes_max + kUrgentReserveBytes + 1000 * kAckBytes);
  }

  [[nodiscard]] Now now() const { return now_ms(static_cast<std::int64_t>(time_ms_)); }

  std::mt19937_64 random_;
  OutboxOptions options_;
  Outbox outbox_;
  Reassembly receiver_{ReassemblyOptions{}};
  std::map<ChannelId, Reassembly::Stream> streams_;
  std::map<ChannelId, Channel> channels_;
  std::set<std::uint64_t> tracked_;  // numbers of tracked messages
  std::deque<Whole> undelivered_;    // tracked, arrived, not yet reported
  std::uint64_t time_ms_ = 0;
  std::uint64_t numbers_ = 0;
  std::uint32_t last_channel_ = 0;
  std::uint64_t received_bytes_ = 0;
};

TEST(OutboxRandom, EverythingAddsUpAndArrivesInOrder) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Scenario(seed).run(1500);
    if (HasFailure()) return;
  }
}

}  // namespace
}  // namespace connect_bridge::flow_test
