#include "ros/services/service_mirror.hpp"

#include <algorithm>
#include <utility>

#include "ros/node/own_endpoints.hpp"
#include "ros/rcl/middleware.hpp"
#include "ros/rcl/publisher_ids.hpp"
#include "ros/rcl/qos.hpp"
#include "ros/rcl/rcl_result.hpp"
#include "ros/services/definitions.hpp"

namespace connect_bridge::ros {

ServiceMirror::ServiceMirror(Shared& shared, Create create)
    : Entity(shared.ready, kReadyMessage), shared_(shared), create_(std::move(create)) {}

ServiceMirror::~ServiceMirror() {
  if (!open_) return;
  // The callback stays set: rmw_fastrtps calls it without a check for null, and would crash if a
  // request arrived now. A late call finds its slot (ReadyList).
  ignore_error(rcl_service_fini(&service_, node_.get()));
  shared_.node.own().remove_server(create_.service);
}

std::optional<Refusal> ServiceMirror::open() {
  auto type = shared_.types.service(create_.type, create_.type_hash, create_.any_definition);
  if (auto* refusal = std::get_if<Refusal>(&type)) return std::move(*refusal);
  type_ = std::move(std::get<0>(type));
  node_ = shared_.proxies.get(create_.node);
  rcl_service_options_t options = rcl_service_get_default_options();
  options.qos = service_qos();
  shared_.node.own().announce_server(create_.service);
  rcl_ret_t result =
      rcl_service_init(&service_, node_.get(), type_->handle, create_.service.c_str(), &options);
  if (result != RCL_RET_OK) {
    shared_.node.own().remove_server(create_.service);
    return failure("cannot serve " + create_.service, result);
  }
  open_ = true;
  if (!type_->is_installed) shared_.tell_not_installed(create_.type);
  if (!create_.any_definition) shared_.tell_if_unhashed(create_.type, create_.type_hash);
  result = rcl_service_set_on_new_request_callback(&service_, &ReadyList::on_counted, slot());
  if (result != RCL_RET_OK) return failure("cannot serve " + create_.service, result);
  const bool known = type_->is_installed && !type_->hash.empty() && !create_.type_hash.empty();
  if (known && type_->hash != create_.type_hash)
    shared_.report(ServiceTypeDiffers{create_.id, type_->hash});
  // Requests may have arrived before the callback was set, and not every middleware reports them.
  ReadyList::mark(slot(), kReadyMessage);
  return std::nullopt;
}

std::optional<Input> ServiceMirror::step(Batch& batch) {
  MessageForm& form = *type_->request;
  const bool more = expects_more();
  rmw_service_info_t info{};
  const rcl_ret_t result = rcl_take_request_with_info(&service_, &info, form.message());
  if (result != RCL_RET_OK) {
    // A sample may be no request: its writer is gone, or it has another type. The result then looks
    // like an empty queue, but more may follow.
    form.reset();
    if (!more) done(kReadyMessage);
    if (result != RCL_RET_SERVICE_TAKE_FAILED) {
      shared_.refuse_call(error_text("cannot take a request of " + create_.service, result));
    }
    ignore_error(result);
    return std::nullopt;
  }
  auto bytes = shared_.bytes_of(form, batch);
  if (const auto* why = std::get_if<std::string>(&bytes)) {
    shared_.refuse_call("a request of " + create_.service + " is lost: " + *why);
    return std::nullopt;
  }
  const RequestId request{++last_request_};
  requests_.insert_or_assign(request, Request{info.request_id, std::chrono::steady_clock::now()});
  if (middleware().tells_callers() && !callers_.contains(caller_in_graph(info.request_id))) {
    new_callers_ = true;
    shared_.look_again(Duration::zero());
  }
  return RequestTaken{create_.id, request, std::get<Payload>(std::move(bytes))};
}

void ServiceMirror::respond(RequestId request, ByteView bytes) {
  const auto found = requests_.find(request);
  if (found == requests_.end()) return;
  rmw_request_id_t id = found->second.id;
  requests_.erase(found);
  if (const auto problem = send(id, bytes)) shared_.refuse_call(*problem);
}

void ServiceMirror::drop(RequestId request, bool aborted) {
  const Payload result = aborted && requests_.contains(request) ? aborted_result() : Payload{};
  if (result.view().empty()) {
    requests_.erase(request);
    return;
  }
  aborts_ = true;
  respond(request, result.view());
}

Payload ServiceMirror::aborted_result() {
  // The status comes first in a result, behind the header of CDR.
  constexpr std::size_t kStatusAt = 4;
  constexpr std::uint8_t kStatusAborted = 6;  // action_msgs/msg/GoalStatus
  MessageForm& form = *type_->response;
  form.reset();
  Batch unused;
  const auto empty = type_->is_installed ? shared_.bytes_of(form, unused) : Payload{};
  const auto* const result = std::get_if<Payload>(&empty);
  if (result == nullptr || result->size() <= kStatusAt) {
    shared_.refuse_call("a caller of " + create_.service +
                        " is not told that its goal was aborted: the type is not installed");
    return {};
  }
  const ByteView view = result->view();
  Bytes bytes{view.begin(), view.end()};
  bytes[kStatusAt] = kStatusAborted;
  return Payload::adopt(std::move(bytes));
}

std::optional<std::string> ServiceMirror::send(rmw_request_id_t& request, ByteView bytes) {
  const Gid caller = caller_of(request);
  if (std::find(unconnected_.begin(), unconnected_.end(), caller) != unconnected_.end()) {
    return "a caller of " + create_.service + " cannot be reached: its answer is dropped";
  }
  MessageForm& form = *type_->response;
  if (const auto problem = form.read_from(bytes, shared_.memory_max())) {
    return "an answer of " + create_.service + " is dropped: " + *problem;
  }
  const rcl_ret_t result = rcl_send_response(&service_, &request, form.message());
  form.reset();
  if (result == RCL_RET_OK) return std::nullopt;
  // The middleware did not find the caller's reader of responses in time.
  if (result == RCL_RET_TIMEOUT) unconnected_.push_back(caller);
  return error_text("cannot answer a request of " + create_.service, result);
}

Gid ServiceMirror::caller_in_graph(const rmw_request_id_t& request) const {
  return middleware().caller_in_graph(request, shared_.node.publisher_ids());
}

std::vector<RequestId> ServiceMirror::look_for_callers() {
  new_callers_ = doubtful_callers_ = false;
  std::vector<RequestId> gone;
  if (requests_.empty()) return gone;
  auto callers = callers_in_graph(node_.get(), rcl_service_get_service_name(&service_));
  if (!callers) return gone;
  const auto doubtful_since = std::chrono::steady_clock::now() - kDoubt;
  std::erase_if(requests_, [&](const auto& entry) {
    const Gid caller = caller_in_graph(entry.second.id);
    if (callers->contains(caller)) return false;
    // A request may arrive before the graph shows its caller.
    if (!callers_.contains(caller) && entry.second.taken > doubtful_since) {
      doubtful_callers_ = true;
      return false;
    }
    gone.push_back(entry.first);
    return true;
  });
  std::sort(gone.begin(), gone.end());
  callers_ = std::move(*callers);
  return gone;
}

void ServiceMirror::compare_clients() {
  compare_definitions(shared_, rcl_service_get_service_name(&service_), *type_,
                      ServiceEnd::kClient);
}

}  // namespace connect_bridge::ros
