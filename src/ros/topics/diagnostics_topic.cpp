#include "ros/topics/diagnostics_topic.hpp"

#include <utility>

#include "ros/rcl/qos.hpp"
#include "ros/rcl/rcl_result.hpp"
#include "ros/topics/topic_types.hpp"

namespace connect_bridge::ros {
namespace {

// Hash of the definition in all distributions (REP 2011).
constexpr char kDiagnosticsHash[] =
    "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e";

}  // namespace

DiagnosticsTopic::~DiagnosticsTopic() {
  if (open_) ignore_error(rcl_publisher_fini(&publisher_, shared_.node.handle()));
}

std::optional<Refusal> DiagnosticsTopic::open() {
  auto type = shared_.types.message(kDiagnosticsType, kDiagnosticsHash);
  if (auto* refusal = std::get_if<Refusal>(&type)) return std::move(*refusal);
  type_ = std::move(std::get<MessageType>(type));
  rcl_publisher_options_t options = rcl_publisher_get_default_options();
  Qos qos;
  qos.depth = 1;
  options.qos = to_rmw(qos);
  const rcl_ret_t result = rcl_publisher_init(&publisher_, shared_.node.handle(),
                                              type_.handle.get(), kDiagnosticsTopic, &options);
  if (result != RCL_RET_OK)
    return endpoint_failure(shared_.node, kDiagnosticsTopic, kDiagnosticsType, "cannot publish on",
                            result);
  open_ = true;
  shared_.node.show(publisher_);
  return std::nullopt;
}

bool DiagnosticsTopic::wanted() const {
  std::size_t count = 0;
  if (open_) ignore_error(rcl_publisher_get_subscription_count(&publisher_, &count));
  return count > 0;
}

void DiagnosticsTopic::publish(ByteView sample) {
  if (!open_) return;
  const rcl_serialized_message_t message = as_serialized(sample);
  ignore_error(rcl_publish_serialized_message(&publisher_, &message, nullptr));
}

}  // namespace connect_bridge::ros
