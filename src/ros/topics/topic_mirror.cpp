#include "ros/topics/topic_mirror.hpp"

#include <utility>

#include "ros/node/own_endpoints.hpp"
#include "ros/rcl/qos.hpp"
#include "ros/rcl/rcl_result.hpp"
#include "ros/topics/topic_types.hpp"
#include "ros/types/cdr_check.hpp"

namespace connect_bridge::ros {
namespace {

// Subscribers allocate memory for as many elements as a sequence claims to have, before they read
// them: at most as many as the message has bytes. Below this size that is little.
constexpr std::size_t kUncheckedBytesMax = 1024;

}  // namespace

Publisher::~Publisher() {
  if (!open_) return;
  ignore_error(rcl_publisher_fini(&publisher_, node_.get()));
  if (own_id_) shared_.node.own().remove(*own_id_);
}

std::optional<Refusal> Publisher::open(const CreateMirror& create) {
  topic_ = create.topic;
  type_name_ = create.type;
  auto type = shared_.types.message(create.type, create.type_hash, create.any_definition);
  if (auto* refusal = std::get_if<Refusal>(&type)) return std::move(*refusal);
  type_ = std::move(std::get<MessageType>(type));
  node_ = shared_.proxies.get(create.node);
  rcl_publisher_options_t options = rcl_publisher_get_default_options();
  options.qos = to_rmw(create.qos);
  auto making = shared_.node.own().making();
  const rcl_ret_t result = rcl_publisher_init(&publisher_, node_.get(), type_.handle.get(),
                                              create.topic.c_str(), &options);
  if (result != RCL_RET_OK)
    return endpoint_failure(shared_.node, create.topic, create.type, "cannot publish on", result);
  open_ = true;
  own_id_ = shared_.node.add_own(publisher_);
  making.unlock();
  if (own_id_) shared_.report(MirrorMade{create.id, *own_id_});
  if (type_.introspection == nullptr) shared_.tell_not_installed(create.type);
  if (type_.introspection != nullptr && has_keys(*type_.introspection))
    form_ = installed_form(type_.handle.get());
  if (!create.any_definition) shared_.tell_if_unhashed(create.type, create.type_hash);
  if (!type_.other_hash.empty()) shared_.report(TypeDiffers{create.id, type_.other_hash});
  return std::nullopt;
}

std::optional<std::string> Publisher::check(ByteView bytes) const {
  if (form_) return std::nullopt;  // publish() checks it
  const bool small = bytes.size() <= kUncheckedBytesMax && type_.other_hash.empty();
  if (type_.introspection == nullptr || small) return std::nullopt;
  const auto problem = check_cdr(bytes, *type_.introspection, sample_limits(bytes.size()));
  if (!problem) return std::nullopt;
  return "a peer's message on " + topic_ + " is no " + type_name_ + ": " + *problem;
}

std::optional<std::string> Publisher::publish(ByteView bytes) {
  rcl_ret_t result = RCL_RET_OK;
  if (form_) {
    // rmw_fastrtps gives all serialized samples one key, so a late subscriber would get only the
    // samples of the last key.
    if (auto problem = form_->read_from(bytes, shared_.memory_max()))
      return "a peer's message on " + topic_ + ": " + *problem;
    result = rcl_publish(&publisher_, form_->message(), nullptr);
    form_->reset();
  } else {
    const rcl_serialized_message_t message = as_serialized(bytes);
    result = rcl_publish_serialized_message(&publisher_, &message, nullptr);
  }
  if (result == RCL_RET_OK) return std::nullopt;
  return error_text("cannot publish on " + topic_, result);
}

TopicMirror::TopicMirror(Shared& shared, Create create)
    : Entity(shared.ready, kReadyFailed),
      shared_(shared),
      create_(std::move(create)),
      publisher_(std::make_shared<Publisher>(shared)) {}

std::optional<Refusal> TopicMirror::open() {
  return publisher_->open(create_);
}

void TopicMirror::publish(const Publish& sample, SampleCheck& check) {
  if (is_checked_beside(sample)) {
    ++checked_;
    return check.add({publisher_, sample});
  }
  const ByteView bytes = sample.payload.view();
  const auto problem = publisher_->check(bytes);
  count(problem ? problem : publisher_->publish(bytes));
}

void TopicMirror::on_checked(const SampleCheck::Sample& sample) {
  --checked_;
  count(sample.problem ? sample.problem : publisher_->publish(sample.what.payload.view()));
}

void TopicMirror::count(const std::optional<std::string>& problem) {
  if (!problem) return static_cast<void>(++shared_.counters.published);
  shared_.node.log(shared_.unpublished, LogLevel::kWarn, *problem);
  if (unpublished_++ == 0) ReadyList::mark(slot(), kReadyFailed);
}

std::optional<Input> TopicMirror::step(Batch&) {
  done(kReadyFailed);
  return PublishFailed{create_.id, std::exchange(unpublished_, 0)};
}

}  // namespace connect_bridge::ros
