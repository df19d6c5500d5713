#include "ros/services/service_client.hpp"

#include <rcl/graph.h>

#include <algorithm>

#include "ros/rcl/distro.hpp"
#include "ros/rcl/qos.hpp"
#include "ros/rcl/rcl_result.hpp"
#include "ros/services/definitions.hpp"

namespace connect_bridge::ros {
namespace {

// Answers to dropped invocations still show the core that the server is done with them. Beyond this
// number later answers show the same.
constexpr std::size_t kDroppedKept = 64;

}  // namespace

ServiceClient::ServiceClient(Shared& shared, Create create)
    : Entity(shared.ready, kReadyMessage), shared_(shared), create_(std::move(create)) {}

ServiceClient::~ServiceClient() {
  if (!open_) return;
  ignore_error(rcl_client_set_on_new_response_callback(&client_, nullptr, nullptr));
  ignore_error(rcl_client_fini(&client_, shared_.node.handle()));
}

std::optional<Refusal> ServiceClient::open() {
  auto type = shared_.types.service(create_.type, {});
  if (auto* refusal = std::get_if<Refusal>(&type)) return std::move(*refusal);
  type_ = std::move(std::get<0>(type));
  rcl_client_options_t options = rcl_client_get_default_options();
  options.qos = service_qos();
  rcl_ret_t result = rcl_client_init(&client_, shared_.node.handle(), type_->handle,
                                     create_.service.c_str(), &options);
  if (result != RCL_RET_OK) return failure("cannot call " + create_.service, result);
  open_ = true;
  if (!type_->is_installed) shared_.tell_not_installed(create_.type);
  result = rcl_client_set_on_new_response_callback(&client_, &ReadyList::on_counted, slot());
  if (result != RCL_RET_OK) return failure("cannot call " + create_.service, result);
  return std::nullopt;
}

void ServiceClient::send(InvocationId invocation, ByteView bytes) {
  MessageForm& form = *type_->request;
  if (auto problem = form.read_from(bytes, shared_.memory_max())) {
    return shared_.report(failed(invocation, std::move(*problem)));
  }
  std::int64_t sequence = 0;
  const rcl_ret_t result = rcl_send_request(&client_, form.message(), &sequence);
  form.reset();
  if (result != RCL_RET_OK) {
    return shared_.report(failed(invocation, error_text("cannot call " + create_.service, result)));
  }
  sent_[sequence] = {invocation, false};
}

void ServiceClient::drop(InvocationId invocation) {
  const auto found = std::find_if(sent_.begin(), sent_.end(), [&](const auto& entry) {
    return entry.second.invocation == invocation && !entry.second.dropped;
  });
  if (found == sent_.end()) return;
  found->second.dropped = true;
  if (++dropped_ <= kDroppedKept) return;
  const auto oldest = std::find_if(sent_.begin(), sent_.end(),
                                   [](const auto& entry) { return entry.second.dropped; });
  sent_.erase(oldest);
  --dropped_;
}

std::optional<Input> ServiceClient::step(Batch& batch) {
  MessageForm& form = *type_->response;
  const bool more = expects_more();
  rmw_service_info_t info{};
  const rcl_ret_t result = rcl_take_response_with_info(&client_, &info, form.message());
  if (result != RCL_RET_OK) {
    // The middleware also takes answers to other clients. The result is then the same as for an
    // empty queue, but the message is filled.
    form.reset();
    if (!more) done(kReadyMessage);
    if (result != RCL_RET_CLIENT_TAKE_FAILED) {
      shared_.refuse_call(error_text("cannot take an answer of " + create_.service, result));
    }
    ignore_error(result);
    return std::nullopt;
  }
  const auto found = sent_.find(info.request_id.sequence_number);
  if (found == sent_.end()) {  // another server has answered first
    form.reset();
    return std::nullopt;
  }
  const auto [invocation, dropped] = found->second;
  sent_.erase(found);
  if (dropped) {
    --dropped_;
    form.reset();
    return ResponseTaken{create_.id, invocation, {}};
  }
  auto bytes = shared_.bytes_of(form, batch);
  if (const auto* why = std::get_if<std::string>(&bytes))
    return failed(invocation, "the answer is lost: " + *why);
  return ResponseTaken{create_.id, invocation, std::get<Payload>(std::move(bytes))};
}

Input ServiceClient::failed(InvocationId invocation, std::string reason) {
  ++shared_.counters.refused_calls;
  return InvocationFailed{create_.id, invocation, std::move(reason)};
}

std::optional<ServiceReady> ServiceClient::look_for_server(ServerSight::Time now) {
  const rcl_node_t* node = shared_.node.handle();
  bool reached = false;
  if (!ignore_error(rcl_service_server_is_available(node, &client_, &reached))) reached = false;
  const bool in_graph =
      reached || distro::count_servers(node, create_.service.c_str()).value_or(0) > 0;
  compare_servers(in_graph);
  if (!server_.look(reached, in_graph, now)) return std::nullopt;
  return ServiceReady{create_.id, server_.is_ready(), type_->hash};
}

// Servers that are not reached are compared, too: Fast DDS 3 does not connect two definitions.
void ServiceClient::compare_servers(bool in_graph) {
  compared_ = in_graph && (compared_ || compare_definitions(shared_, create_.service, *type_,
                                                            ServiceEnd::kServer));
}

}  // namespace connect_bridge::ros
