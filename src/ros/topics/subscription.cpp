#include "ros/topics/subscription.hpp"

#include <rmw/events_statuses/events_statuses.h>
#include <rmw/rmw.h>

#include <bit>

#include "ros/rcl/distro.hpp"
#include "ros/rcl/qos.hpp"
#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {
namespace {

// Most samples fit; a larger one costs one realloc of a block that holds nothing yet.
constexpr std::size_t kFirstCapacity = 256;
// CDR begins with 4 bytes that tell the encapsulation.
constexpr std::size_t kSampleMin = 4;
// How often a middleware without a safe callback is asked whether samples were lost.
constexpr auto kLostPeriod = std::chrono::milliseconds(500);

}  // namespace

struct TakeBuffer::Owned {
  rcl_serialized_message_t message = rmw_get_zero_initialized_serialized_message();
  Owned() {
    auto allocator = rcl_get_default_allocator();
    ignore_error(rmw_serialized_message_init(&message, kFirstCapacity, &allocator));
  }
  ~Owned() {
    if (message.buffer != nullptr) ignore_error(rmw_serialized_message_fini(&message));
  }
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;
};

rcl_serialized_message_t* TakeBuffer::prepare() {
  if (!owned_) owned_ = std::make_shared<Owned>();
  owned_->message.buffer_length = 0;
  return &owned_->message;
}

Payload TakeBuffer::give_away() {
  const ByteView view{owned_->message.buffer, owned_->message.buffer_length};
  return Payload::wrap(std::move(owned_), view);
}

Subscription::Subscription(Node& node, SubscriptionId id, Setup setup, ReadyList::Slot* slot)
    : node_(node), id_(id), setup_(std::move(setup)), slot_(slot) {}

Subscription::~Subscription() {
  close();
}

std::optional<std::string> Subscription::open() {
  rcl_subscription_options_t options = rcl_subscription_get_default_options();
  options.qos = setup_.qos;
  options.rmw_subscription_options.ignore_local_publications = setup_.ignore_local;
  rcl_ret_t result = rcl_subscription_init(&subscription_, node_.handle(), setup_.type,
                                           setup_.topic.c_str(), &options);
  std::optional<std::string> problem;
  if (result != RCL_RET_OK) problem = error_text("cannot subscribe to " + setup_.topic, result);
  ignore_error(rcl_subscription_options_fini(&options));
  if (problem) return problem;
  open_ = true;
  tells_origin_ = distro::samples_tell_origin();
  asks_for_lost_ = !distro::lost_callback_is_safe();
  lost_total_ = 0;
  lost_.open(&subscription_, RCL_SUBSCRIPTION_MESSAGE_LOST,
             asks_for_lost_ ? nullptr : &ReadyList::on_lost, slot_);
  incompatible_.open(&subscription_, RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS,
                     &ReadyList::on_incompatible, slot_);
  result =
      rcl_subscription_set_on_new_message_callback(&subscription_, &ReadyList::on_message, slot_);
  if (result != RCL_RET_OK) {
    problem = error_text("cannot listen to " + setup_.topic, result);
    close();
    return problem;
  }
  // What came before the callback was set: not every middleware reports it.
  ReadyList::mark(slot_, kReadyMessage);
  return std::nullopt;
}

void Subscription::close() {
  if (!open_) return;
  open_ = false;
  ignore_error(rcl_subscription_set_on_new_message_callback(&subscription_, nullptr, nullptr));
  lost_.close();
  incompatible_.close();
  ignore_error(rcl_subscription_fini(&subscription_, node_.handle()));
  subscription_ = rcl_get_zero_initialized_subscription();
}

Subscription::Taken Subscription::take(TakeBuffer& buffer, MessageTaken& message) {
  if (!open_) return Taken::kNothing;
  rmw_message_info_t info;
  rcl_serialized_message_t* into = buffer.prepare();
  const rcl_ret_t result = rcl_take_serialized_message(&subscription_, into, &info, nullptr);
  if (result != RCL_RET_OK) {
    ask_for_lost();
    if (result == RCL_RET_SUBSCRIPTION_TAKE_FAILED) {
      ignore_error(result);
      return Taken::kNothing;
    }
    const auto text = error_text("cannot take from " + setup_.topic, result);
    if (std::has_single_bit(++errors_)) {
      node_.log(LogLevel::kError, text + " (" + std::to_string(errors_) + " times)");
    }
    return Taken::kInvalid;  // good samples may wait behind it
  }
  if (into->buffer_length < kSampleMin) return Taken::kInvalid;
  if (++samples_ % 64 == 0) ask_for_lost();
  message.subscription = id_;
  message.origin = tells_origin_ ? distro::gid_of(info.publisher_gid.data) : Gid{};
  message.stamp = info.source_timestamp;
  message.payload = buffer.give_away();
  return Taken::kSample;
}

void Subscription::ask_for_lost() {
  if (!asks_for_lost_) return;
  const auto now = std::chrono::steady_clock::now();
  if (now - lost_asked_ < kLostPeriod) return;
  lost_asked_ = now;
  slot_->bits_of_turn |= kReadyLost;
}

std::uint64_t Subscription::take_lost() {
  rmw_message_lost_status_t status{};
  if (!lost_.take(&status)) return 0;
  // The change counts from moments that differ between middlewares; the total does not.
  const std::uint64_t total = status.total_count;
  const std::uint64_t lost = total > lost_total_ ? total - lost_total_ : 0;
  lost_total_ = total;
  return lost;
}

std::optional<std::string> Subscription::take_incompatible_policy() {
  rmw_requested_qos_incompatible_event_status_t status{};
  if (!incompatible_.take(&status)) return std::nullopt;
  return policy_name(status.last_policy_kind);
}

}  // namespace connect_bridge::ros
