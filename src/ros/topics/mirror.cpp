#include "ros/topics/mirror.hpp"

#include <utility>

#include "ros/node/own_endpoints.hpp"
#include "ros/rcl/qos.hpp"
#include "ros/rcl/rcl_result.hpp"
#include "ros/topics/topic_types.hpp"
#include "ros/types/cdr_check.hpp"

namespace connect_bridge::ros {
namespace {

// A subscriber allocates memory for as many elements as a sequence claims to have, before it reads
// them: at most as many as the message has bytes. Below this size that is little.
constexpr std::size_t kUncheckedBytesMax = 1024;

}  // namespace

Mirror::Mirror(Shared& shared, Create create)
    : Entity(shared.ready, kReadyFailed), shared_(shared), create_(std::move(create)) {}

Mirror::~Mirror() {
  if (!open_) return;
  ignore_error(rcl_publisher_fini(&publisher_, node_.get()));
  if (own_id_) shared_.node.own().remove(*own_id_);
}

std::optional<Refusal> Mirror::open() {
  auto type = shared_.types.message(create_.type, create_.type_hash, create_.any_definition);
  if (auto* refusal = std::get_if<Refusal>(&type)) return std::move(*refusal);
  type_ = std::move(std::get<MessageType>(type));
  node_ = shared_.proxies.get(create_.node);
  rcl_publisher_options_t options = rcl_publisher_get_default_options();
  options.qos = to_rmw(create_.qos);
  auto making = shared_.node.own().making();
  const rcl_ret_t result = rcl_publisher_init(&publisher_, node_.get(), type_.handle.get(),
                                              create_.topic.c_str(), &options);
  if (result != RCL_RET_OK)
    return endpoint_failure(shared_.node, create_.topic, create_.type, "cannot publish on", result);
  open_ = true;
  own_id_ = shared_.node.add_own(publisher_);
  making.unlock();
  if (own_id_) shared_.report(MirrorMade{create_.id, *own_id_});
  if (type_.introspection == nullptr) shared_.tell_not_installed(create_.type);
  if (type_.introspection != nullptr && has_keys(*type_.introspection))
    shared_.tell_keys(create_.type);
  if (!create_.any_definition) shared_.tell_if_unhashed(create_.type, create_.type_hash);
  if (!type_.other_hash.empty()) shared_.report(TypeDiffers{create_.id, type_.other_hash});
  return std::nullopt;
}

void Mirror::publish(ByteView bytes) {
  const bool small = bytes.size() <= kUncheckedBytesMax && type_.other_hash.empty();
  if (const auto* fields = type_.introspection; fields != nullptr && !small) {
    if (const auto problem = check_cdr(bytes, *fields, sample_limits(bytes.size())))
      return refuse("a peer's message on " + create_.topic + " is no " + create_.type + ": " +
                    *problem);
  }
  const rcl_serialized_message_t message = as_serialized(bytes);
  const rcl_ret_t result = rcl_publish_serialized_message(&publisher_, &message, nullptr);
  if (result == RCL_RET_OK) {
    ++shared_.counters.published;
    return;
  }
  refuse(error_text("cannot publish on " + create_.topic, result));
}

void Mirror::refuse(const std::string& text) {
  shared_.node.log(shared_.unpublished, LogLevel::kWarn, text);
  if (unpublished_++ == 0) ReadyList::mark(slot(), kReadyFailed);
}

std::optional<Input> Mirror::step(Batch&) {
  done(kReadyFailed);
  return PublishFailed{create_.id, std::exchange(unpublished_, 0)};
}

}  // namespace connect_bridge::ros
