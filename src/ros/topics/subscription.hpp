// One subscription that takes serialized samples.
#pragma once

#include <rcl/subscription.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/ports/ports.hpp"
#include "ros/entities/ready_list.hpp"
#include "ros/node/node.hpp"
#include "ros/rcl/qos_event.hpp"

namespace connect_bridge::ros {

// A buffer that rmw grows to the size of the sample and that then belongs to a Payload. Kept by the
// caller over takes that find nothing.
class TakeBuffer {
 public:
  // Ready to take into; allocates only if the last one was given away.
  rcl_serialized_message_t* prepare();
  // The sample becomes a payload, without copying its bytes.
  Payload give_away();
  void reset() { owned_.reset(); }

 private:
  struct Owned;
  std::shared_ptr<Owned> owned_;
};

// Thread: the loop's.
class Subscription {
 public:
  struct Setup {
    std::string topic;
    const rosidl_message_type_support_t* type = nullptr;
    rmw_qos_profile_t qos{};
    bool ignore_local = true;  // as far as the middleware can
  };
  enum class Taken { kNothing, kSample, kInvalid };

  // `slot` is marked when there is something to do; it stays the caller's.
  Subscription(Node& node, SubscriptionId id, Setup setup, ReadyList::Slot* slot);
  ~Subscription();
  Subscription(const Subscription&) = delete;
  Subscription& operator=(const Subscription&) = delete;

  // An error text, or nothing.
  std::optional<std::string> open();
  void close();

  // Sets kReadyLost in the slot's turn when it is time to ask for lost samples.
  Taken take(TakeBuffer& buffer, MessageTaken& message);
  // Samples lost since the last call.
  std::uint64_t take_lost();
  std::optional<std::string> take_incompatible_policy();

  [[nodiscard]] SubscriptionId id() const { return id_; }
  [[nodiscard]] const std::string& topic() const { return setup_.topic; }
  [[nodiscard]] ReadyList::Slot* slot() const { return slot_; }

  int invalid_in_row = 0;  // counted by the caller

 private:
  void ask_for_lost();

  Node& node_;
  const SubscriptionId id_;
  const Setup setup_;
  ReadyList::Slot* const slot_;
  rcl_subscription_t subscription_ = rcl_get_zero_initialized_subscription();
  bool open_ = false;
  bool tells_origin_ = true;
  bool asks_for_lost_ = false;
  std::uint64_t samples_ = 0;
  QosEvent lost_;
  QosEvent incompatible_;
  std::uint64_t lost_total_ = 0;
  std::chrono::steady_clock::time_point lost_asked_{};
  std::uint64_t errors_ = 0;
};

}  // namespace connect_bridge::ros
