#include "ros/topics/subscription.hpp"

#include <rmw/events_statuses/events_statuses.h>

#include <algorithm>
#include <utility>

#include "core/graph/claim_message.hpp"
#include "core/graph/graph_view.hpp"
#include "core/policy/treatment.hpp"
#include "ros/node/own_endpoints.hpp"
#include "ros/rcl/distro.hpp"
#include "ros/rcl/middleware.hpp"
#include "ros/rcl/publisher_ids.hpp"
#include "ros/rcl/qos.hpp"
#include "ros/rcl/rcl_result.hpp"
#include "ros/topics/diagnostics_topic.hpp"
#include "ros/topics/topic_types.hpp"

namespace connect_bridge::ros {
namespace {

// Size of CDR's header, the encapsulation.
constexpr std::size_t kSampleMin = 4;
// The period of polls for lost samples, with a middleware without a safe callback.
constexpr auto kLostPeriod = std::chrono::milliseconds(500);
// rmw_fastrtps was seen to return empty samples without end after a large one was lost in part.
// This many in a row exceed a queue of real ones.
constexpr int kInvalidInRowMax = 32;
// A reliable publisher may send many samples at once, and all are for the peer. The graph does not
// always show how many it keeps; a subscriber that keeps less loses the rest without a word. Large
// types do without: a thousand of their samples would take memory that no budget counts.
constexpr std::uint32_t kReliableDepth = 1000;
// Publishers whose numbers are known at a time.
constexpr std::size_t kNumbersMax = 1024;

Qos with_depth_for_bursts(const CreateSubscription& create) {
  Qos qos = create.qos;
  if (qos.reliability == Reliability::kReliable && qos.durability == Durability::kVolatile &&
      default_priority(create.topic, create.type) != Priority::kBulk)
    qos.depth = std::max(qos.depth, kReliableDepth);
  return qos;
}

}  // namespace

Subscription::Subscription(Shared& shared, Create create, bool ignore_local)
    : Entity(shared.ready, kReadyMessage | kReadyLost | kReadyIncompatible),
      shared_(shared),
      create_(std::move(create)),
      ignore_local_(ignore_local),
      asks_for_lost_(!middleware().lost_callback_is_safe) {}

Subscription::~Subscription() {
  close();
}

std::optional<Refusal> Subscription::open() {
  auto type = shared_.types.message(create_.type, create_.type_hash);
  if (auto* refusal = std::get_if<Refusal>(&type)) {
    if (refusal->code == "type_mismatch")
      refusal->reason = "the nodes that use it have another definition of " + create_.type + " (" +
                        create_.type_hash + ") than this bridge (" + refusal->hash_here +
                        "): start it with the workspace that they use";
    return std::move(*refusal);
  }
  type_ = std::move(std::get<MessageType>(type));
  node_ = shared_.proxies.get({});
  rcl_subscription_options_t options = rcl_subscription_get_default_options();
  options.qos = to_rmw(with_depth_for_bursts(create_));
  // The peer receives the diagnostics of this process. If samples do not show their publisher in
  // this process, the samples of its mirror would come back, and circulate forever.
  const bool wants_own = create_.topic == kDiagnosticsTopic && middleware().tells_origins();
  options.rmw_subscription_options.ignore_local_publications =
      ignore_local_ && middleware().ignoring_local_is_safe && !wants_own;
  rcl_ret_t result = rcl_subscription_init(&subscription_, node_.get(), type_.handle.get(),
                                           create_.topic.c_str(), &options);
  std::optional<Refusal> refusal;
  if (result != RCL_RET_OK)
    refusal =
        endpoint_failure(shared_.node, create_.topic, create_.type, "cannot subscribe to", result);
  ignore_error(rcl_subscription_options_fini(&options));
  if (refusal) return refusal;
  open_ = true;
  if (type_.introspection == nullptr) shared_.tell_not_installed(create_.type);
  lost_total_ = missing_ = 0;
  numbers_.clear();
  lost_.open(&subscription_, RCL_SUBSCRIPTION_MESSAGE_LOST,
             asks_for_lost_ ? nullptr : &ReadyList::on_lost, slot());
  incompatible_.open(&subscription_, RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS,
                     &ReadyList::on_incompatible, slot());
  result =
      rcl_subscription_set_on_new_message_callback(&subscription_, &ReadyList::on_message, slot());
  if (result != RCL_RET_OK) {
    refusal = failure("cannot listen to " + create_.topic, result);
    close();
    return refusal;
  }
  // Samples may have arrived before the callback was set, and not every middleware reports them.
  ReadyList::mark(slot(), kReadyMessage);
  return std::nullopt;
}

void Subscription::close() {
  if (!open_) return;
  open_ = false;
  ignore_error(rcl_subscription_set_on_new_message_callback(&subscription_, nullptr, nullptr));
  lost_.close();
  incompatible_.close();
  ignore_error(rcl_subscription_fini(&subscription_, node_.get()));
  node_.reset();
  subscription_ = rcl_get_zero_initialized_subscription();
}

std::optional<Input> Subscription::step(Batch& batch) {
  if (has_to(kReadyIncompatible)) {
    done(kReadyIncompatible);
    const auto policy = incompatible_.take_policy();
    if (!policy) return std::nullopt;
    return QosIncompatible{create_.id, create_.topic, *policy};
  }
  if (has_to(kReadyLost)) {
    done(kReadyLost);
    const auto lost = take_lost();
    if (lost == 0) return std::nullopt;
    return MessagesLost{create_.id, lost, false};
  }
  MessageTaken message;
  const Taken taken = take(message);
  if (taken == Taken::kNothing) {
    done(kReadyMessage);
    return std::nullopt;
  }
  if (taken == Taken::kInvalid) return on_invalid();
  invalid_in_row_ = 0;
  batch.bytes += message.payload.size();
  if (shared_.node.own().contains(message.origin)) return std::nullopt;
  if (message.payload.size() > bytes_max()) return MessagesLost{create_.id, 1, true};
  ++shared_.counters.taken;
  return Input{std::move(message)};
}

// Claims are not sent to peers, so the limit of messages does not apply. If a claim were dropped,
// two bridges would mirror the same topic.
std::size_t Subscription::bytes_max() const {
  return create_.topic == kClaimsTopic ? kClaimBytesMax : shared_.message_bytes_max;
}

std::optional<Input> Subscription::on_invalid() {
  if (++invalid_in_row_ < kInvalidInRowMax) return std::nullopt;
  invalid_in_row_ = 0;
  shared_.node.log(LogLevel::kWarn, "the middleware returns empty samples of " + create_.topic +
                                        " without end: subscribing again");
  done(~0U);
  close();
  if (auto refusal = open()) {
    return SubscriptionFailed{create_.id, std::move(refusal->code), std::move(refusal->reason)};
  }
  return MessagesLost{create_.id, 1, false};
}

Subscription::Taken Subscription::take(MessageTaken& message) {
  if (!open_) return Taken::kNothing;
  rmw_message_info_t info;
  rcl_serialized_message_t* into = shared_.buffer.prepare();
  const rcl_ret_t result = rcl_take_serialized_message(&subscription_, into, &info, nullptr);
  if (result != RCL_RET_OK) {
    ask_for_lost();
    if (result == RCL_RET_SUBSCRIPTION_TAKE_FAILED) {
      ignore_error(result);
      return Taken::kNothing;
    }
    shared_.node.log(errors_, LogLevel::kError,
                     error_text("cannot take from " + create_.topic, result));
    return Taken::kInvalid;  // valid samples may follow
  }
  if (into->buffer_length < kSampleMin) return Taken::kInvalid;
  if (++samples_ % 64 == 0) ask_for_lost();
  message.subscription = create_.id;
  message.origin = shared_.node.publisher_ids().id_of(distro::gid_of(info.publisher_gid.data));
  message.stamp = info.source_timestamp;
  if (info.publication_sequence_number != RMW_MESSAGE_INFO_SEQUENCE_NUMBER_UNSUPPORTED)
    message.number = info.publication_sequence_number;
  count_missing(message);
  message.payload = shared_.buffer.give_away();
  return Taken::kSample;
}

// A middleware reports what did not arrive, and not what a full queue here has displaced.
void Subscription::count_missing(const MessageTaken& message) {
  if (message.number == 0) return;
  if (numbers_.size() >= kNumbersMax && !numbers_.contains(message.origin)) numbers_.clear();
  std::uint64_t& last = numbers_[message.origin];
  if (last != 0 && message.number > last + 1) {
    missing_ += message.number - last - 1;
    do_also(kReadyLost);
  }
  last = std::max(last, message.number);
}

void Subscription::ask_for_lost() {
  if (!asks_for_lost_) return;
  const auto now = std::chrono::steady_clock::now();
  if (now - lost_asked_ < kLostPeriod) return;
  lost_asked_ = now;
  do_also(kReadyLost);
}

// Both counts may have the same sample.
std::uint64_t Subscription::take_lost() {
  rmw_message_lost_status_t status{};
  std::uint64_t total = missing_;
  // Middlewares differ in the start of their count of changes; they agree on the total.
  if (lost_.take(&status)) total = std::max<std::uint64_t>(total, status.total_count);
  const std::uint64_t lost = total > lost_total_ ? total - lost_total_ : 0;
  lost_total_ += lost;
  return lost;
}

}  // namespace connect_bridge::ros
