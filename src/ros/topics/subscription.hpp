// One subscription that takes serialized samples.
#pragma once

#include <rcl/subscription.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>

#include "ros/entities/entity.hpp"
#include "ros/entities/qos_event.hpp"
#include "ros/entities/shared.hpp"

namespace connect_bridge::ros {

// Thread: the loop's.
class Subscription : public Entity {
 public:
  using Create = CreateSubscription;

  // `ignore_local`: the middleware does not deliver samples of this process, if it has such an
  // option. Samples of our mirrors are dropped in any case.
  Subscription(Shared& shared, Create create, bool ignore_local = true);
  ~Subscription() override;

  // Opens the subscription. Returns the refusal; nullopt: it is open.
  std::optional<Refusal> open();
  // Takes one sample or event. SubscriptionFailed: the subscription is closed for good.
  std::optional<Input> step(Batch& batch) override;

 protected:
  enum class Taken { kNothing, kSample, kInvalid };

  Taken take(MessageTaken& message);

 private:
  void close();
  [[nodiscard]] std::size_t bytes_max() const;
  std::optional<Input> on_invalid();
  void ask_for_lost();
  std::uint64_t take_lost();
  // Counts the samples that are missing before this one of its publisher.
  void count_missing(const MessageTaken& message);

  Shared& shared_;
  const Create create_;
  const bool ignore_local_;
  const bool asks_for_lost_;
  MessageType type_;
  ProxyNodes::Handle node_;  // owns the subscription
  rcl_subscription_t subscription_ = rcl_get_zero_initialized_subscription();
  bool open_ = false;
  int invalid_in_row_ = 0;
  std::uint64_t samples_ = 0;
  LogLimit errors_;
  QosEvent lost_;
  QosEvent incompatible_;
  std::uint64_t lost_total_ = 0;                    // of both counts, as far as it was reported
  std::uint64_t missing_ = 0;                       // by the numbers of the samples
  std::unordered_map<Gid, std::uint64_t> numbers_;  // the last one of each publisher
  std::chrono::steady_clock::time_point lost_asked_{};
};

}  // namespace connect_bridge::ros
