#include "ros/services/service_mirror.hpp"

#include <rmw/qos_profiles.h>

#include <algorithm>

#include "ros/rcl/distro.hpp"
#include "ros/rcl/qos.hpp"
#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {

ServiceMirror::ServiceMirror(Setup setup, ReadyList::Slot* slot)
    : setup_(std::move(setup)), slot_(slot) {}

ServiceMirror::~ServiceMirror() {
  if (!open_) return;
  // The callback stays: rmw_fastrtps calls what is set without a look whether it is null, and so
  // would crash when a request arrives now. A late call finds its slot (ReadyList).
  ignore_error(rcl_service_fini(&service_, setup_.node.get()));
}

std::optional<std::string> ServiceMirror::open() {
  rcl_service_options_t options = rcl_service_get_default_options();
  options.qos = service_qos();
  rcl_ret_t result = rcl_service_init(&service_, setup_.node.get(), setup_.type->handle,
                                      setup_.service.c_str(), &options);
  if (result != RCL_RET_OK) return error_text("cannot serve " + setup_.service, result);
  open_ = true;
  slot_->waiting.store(0);
  result = rcl_service_set_on_new_request_callback(&service_, &ReadyList::on_counted, slot_);
  if (result != RCL_RET_OK) return error_text("cannot serve " + setup_.service, result);
  // What came before the callback was set: not every middleware reports it.
  ReadyList::mark(slot_, kReadyMessage);
  return std::nullopt;
}

ServiceMirror::Taken ServiceMirror::take(TakeBuffer& buffer, RequestTaken& request,
                                         std::string& problem) {
  MessageForm& form = *setup_.type->request;
  expected_ += slot_->waiting.exchange(0);
  rmw_service_info_t info{};
  const rcl_ret_t result = rcl_take_request_with_info(&service_, &info, form.message());
  const bool more = expected_ > 1;
  if (expected_ > 0) --expected_;
  if (result == RCL_RET_SERVICE_TAKE_FAILED) {
    ignore_error(result);
    // A sample that is no request (its writer has gone, or it is none of this type) looks the same
    // as an empty queue.
    return more ? Taken::kInvalid : Taken::kNothing;
  }
  if (result != RCL_RET_OK) {
    problem = error_text("cannot take a request of " + setup_.service, result);
    return more ? Taken::kInvalid : Taken::kNothing;
  }
  const auto unwritten = form.write_to(*buffer.prepare());
  form.reset();
  if (unwritten) {
    problem = "a request of " + setup_.service + " is lost: " + *unwritten;
    return Taken::kInvalid;
  }
  if (++last_request_ == 0) ++last_request_;
  request.mirror = setup_.id;
  request.request = RequestId{last_request_};
  request.payload = buffer.give_away();
  requests_.insert_or_assign(request.request,
                             Request{info.request_id, std::chrono::steady_clock::now()});
  if (!callers_.contains(distro::caller_of(info.request_id))) {
    new_callers_ = distro::tells_callers();
  }
  return Taken::kRequest;
}

std::optional<std::string> ServiceMirror::respond(RequestId request, ByteView bytes,
                                                  std::size_t memory_max) {
  const auto found = requests_.find(request);
  if (found == requests_.end()) return std::nullopt;
  rmw_request_id_t id = found->second.id;
  requests_.erase(found);
  const Gid caller = distro::caller_of(id);
  if (std::find(unconnected_.begin(), unconnected_.end(), caller) != unconnected_.end()) {
    return "a caller of " + setup_.service + " cannot be reached: its answer is dropped";
  }
  MessageForm& form = *setup_.type->response;
  if (const auto problem = form.read_from(bytes, memory_max)) {
    return "an answer of " + setup_.service + " is dropped: " + *problem;
  }
  const rcl_ret_t result = rcl_send_response(&service_, &id, form.message());
  form.reset();
  if (result == RCL_RET_OK) return std::nullopt;
  // The request came, but the middleware waited in vain for the caller's end for responses.
  if (result == RCL_RET_TIMEOUT) unconnected_.push_back(caller);
  return error_text("cannot answer a request of " + setup_.service, result);
}

void ServiceMirror::drop(RequestId request) {
  requests_.erase(request);
}

std::vector<RequestId> ServiceMirror::look_for_callers() {
  new_callers_ = doubtful_callers_ = false;
  std::vector<RequestId> gone;
  if (requests_.empty()) return gone;
  auto callers =
      distro::callers_in_graph(setup_.node.get(), rcl_service_get_service_name(&service_));
  if (!callers) return gone;
  const auto doubtful_since = std::chrono::steady_clock::now() - kDoubt;
  std::erase_if(requests_, [&](const auto& entry) {
    const Gid caller = distro::caller_of(entry.second.id);
    if (callers->contains(caller)) return false;
    // A request may overtake the news of its caller.
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

}  // namespace connect_bridge::ros
