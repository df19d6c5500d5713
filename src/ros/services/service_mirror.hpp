// One service server that turns requests of any type into bytes, and answers into responses.
#pragma once

#include <rcl/service.h>

#include <chrono>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "core/ports/ports.hpp"
#include "ros/entities/ready_list.hpp"
#include "ros/node/proxy_nodes.hpp"
#include "ros/topics/subscription.hpp"
#include "ros/types/message_form.hpp"

namespace connect_bridge::ros {

// Thread: the loop's.
class ServiceMirror {
 public:
  struct Setup {
    ServiceMirrorId id;
    std::string service;
    ServiceType* type = nullptr;
    ProxyNodes::Handle node;
  };
  enum class Taken { kNothing, kRequest, kInvalid };

  // `slot` is marked when requests wait; it stays the caller's.
  ServiceMirror(Setup setup, ReadyList::Slot* slot);
  ~ServiceMirror();
  ServiceMirror(const ServiceMirror&) = delete;
  ServiceMirror& operator=(const ServiceMirror&) = delete;

  // An error text, or nothing.
  std::optional<std::string> open();

  // kInvalid: there was something that is no request, and more may wait behind it. `problem` is set
  // where that is worth telling.
  Taken take(TakeBuffer& buffer, RequestTaken& request, std::string& problem);
  // Ends a request; an error text, or nothing. Takes up to `memory_max` for the response. Blocks
  // up to 100 ms if the middleware has not connected the caller with us yet, but for each caller
  // only once until graph_changed().
  std::optional<std::string> respond(RequestId request, ByteView bytes, std::size_t memory_max);
  void drop(RequestId request);

  // Who could not be reached may be now.
  void graph_changed() { unconnected_.clear(); }
  // Forgets and returns the requests whose callers are not in the graph any longer, as far as the
  // middleware tells.
  std::vector<RequestId> look_for_callers();
  // Whether a request came from a caller that was not in the graph when we last looked.
  [[nodiscard]] bool has_new_callers() const { return new_callers_; }
  // A caller that was never seen in the graph may still be on its way there: look again after this.
  [[nodiscard]] bool has_doubtful_callers() const { return doubtful_callers_; }
  static constexpr Duration kDoubt = std::chrono::seconds(1);

  [[nodiscard]] const std::string& service() const { return setup_.service; }
  [[nodiscard]] ReadyList::Slot* slot() const { return slot_; }
  [[nodiscard]] std::size_t requests() const { return requests_.size(); }

 private:
  const Setup setup_;
  ReadyList::Slot* const slot_;
  rcl_service_t service_ = rcl_get_zero_initialized_service();
  bool open_ = false;
  std::uint32_t last_request_ = 0;
  std::size_t expected_ = 0;  // requests that callbacks have told of and take() has not seen
  struct Request {
    rmw_request_id_t id{};
    std::chrono::steady_clock::time_point taken;
  };
  std::unordered_map<RequestId, Request> requests_;
  std::unordered_set<Gid> callers_;  // in the graph when we last looked
  bool new_callers_ = false;
  bool doubtful_callers_ = false;
  std::vector<Gid> unconnected_;  // callers that no response reaches yet
};

}  // namespace connect_bridge::ros
