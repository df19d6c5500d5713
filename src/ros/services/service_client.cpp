#include "ros/services/service_client.hpp"

#include <rcl/graph.h>

#include <algorithm>

#include "ros/rcl/distro.hpp"
#include "ros/rcl/qos.hpp"
#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {
namespace {

// Their answers tell how far the server has come; those that are missed, later answers make up for.
constexpr std::size_t kDroppedKept = 64;

}  // namespace

ServiceClient::ServiceClient(Node& node, Setup setup, ReadyList::Slot* slot)
    : node_(node), setup_(std::move(setup)), slot_(slot) {}

ServiceClient::~ServiceClient() {
  if (!open_) return;
  ignore_error(rcl_client_set_on_new_response_callback(&client_, nullptr, nullptr));
  ignore_error(rcl_client_fini(&client_, node_.handle()));
}

std::optional<std::string> ServiceClient::open() {
  rcl_client_options_t options = rcl_client_get_default_options();
  options.qos = service_qos();
  rcl_ret_t result = rcl_client_init(&client_, node_.handle(), setup_.type->handle,
                                     setup_.service.c_str(), &options);
  if (result != RCL_RET_OK) return error_text("cannot call " + setup_.service, result);
  open_ = true;
  slot_->waiting.store(0);
  result = rcl_client_set_on_new_response_callback(&client_, &ReadyList::on_counted, slot_);
  if (result != RCL_RET_OK) return error_text("cannot call " + setup_.service, result);
  return std::nullopt;
}

std::optional<std::string> ServiceClient::send(InvocationId invocation, ByteView bytes,
                                               std::size_t memory_max) {
  MessageForm& form = *setup_.type->request;
  if (const auto problem = form.read_from(bytes, memory_max)) return problem;
  std::int64_t sequence = 0;
  const rcl_ret_t result = rcl_send_request(&client_, form.message(), &sequence);
  form.reset();
  if (result != RCL_RET_OK) return error_text("cannot call " + setup_.service, result);
  by_sequence_[sequence] = invocation;
  invocations_[invocation] = sequence;
  return std::nullopt;
}

void ServiceClient::drop(InvocationId invocation) {
  const auto found = invocations_.find(invocation);
  if (found == invocations_.end()) return;
  dropped_.emplace_back(found->second, invocation);
  if (dropped_.size() > kDroppedKept) dropped_.pop_front();
  by_sequence_.erase(found->second);
  invocations_.erase(found);
}

ServiceClient::Taken ServiceClient::take(TakeBuffer& buffer, ResponseTaken& response,
                                         std::string& problem) {
  MessageForm& form = *setup_.type->response;
  expected_ += slot_->waiting.exchange(0);
  rmw_service_info_t info{};
  const rcl_ret_t result = rcl_take_response_with_info(&client_, &info, form.message());
  const bool more = expected_ > 1;
  if (expected_ > 0) --expected_;
  if (result != RCL_RET_OK) {
    if (result == RCL_RET_CLIENT_TAKE_FAILED) {
      // The middleware also takes the answers to other clients, and says the same as of none.
      ignore_error(result);
    } else {
      problem = error_text("cannot take an answer of " + setup_.service, result);
    }
    return more ? Taken::kInvalid : Taken::kNothing;
  }
  response.client = setup_.id;
  const auto found = by_sequence_.find(info.request_id.sequence_number);
  if (found == by_sequence_.end()) {  // dropped, or another server's answer came first
    form.reset();
    return take_dropped(info.request_id.sequence_number, response);
  }
  response.invocation = found->second;
  invocations_.erase(found->second);
  by_sequence_.erase(found);
  const auto unwritten = form.write_to(*buffer.prepare());
  form.reset();
  if (unwritten) {
    problem = "the answer is lost: " + *unwritten;
    return Taken::kFailed;
  }
  response.payload = buffer.give_away();
  return Taken::kResponse;
}

ServiceClient::Taken ServiceClient::take_dropped(std::int64_t sequence, ResponseTaken& response) {
  const auto found = std::find_if(dropped_.begin(), dropped_.end(),
                                  [&](const auto& entry) { return entry.first == sequence; });
  if (found == dropped_.end()) return Taken::kInvalid;
  response.invocation = found->second;
  dropped_.erase(found);
  return Taken::kUnwanted;
}

bool ServiceClient::is_ready() const {
  bool ready = false;
  const rcl_ret_t result = rcl_service_server_is_available(node_.handle(), &client_, &ready);
  return ignore_error(result) && ready;
}

}  // namespace connect_bridge::ros
