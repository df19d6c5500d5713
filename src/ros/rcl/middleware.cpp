#include "ros/rcl/middleware.hpp"

#include <rcl/error_handling.h>
#include <rcl/graph.h>
#include <rmw/rmw.h>

#include <algorithm>
#include <iterator>

#include "ros/rcl/cyclone_publishers.hpp"
#include "ros/rcl/distro.hpp"
#include "ros/rcl/graph_queries.hpp"
#include "ros/rcl/publisher_ids.hpp"

namespace connect_bridge::ros {
namespace {

constexpr std::size_t kParticipantBytes = 12;

}  // namespace

Middleware middleware_named(std::string_view identifier, bool finds_handles) {
  Middleware result;
  if (identifier.starts_with("rmw_fastrtps")) {
    result.participant_bytes = kParticipantBytes;
    result.caller_named = Middleware::CallerNamed::kReader;
    result.lost_callback_is_safe = false;
    result.ignoring_local_is_safe = false;
  } else if (identifier == "rmw_cyclonedds_cpp") {
    result.publisher_named = Middleware::PublisherNamed::kHandle;
    result.fills_used_messages = false;
    result.takes_bare_types = result.asks_for_fields = true;
    if (finds_handles) {
      result.participant_bytes = kParticipantBytes;
      result.caller_named = Middleware::CallerNamed::kWriterHandle;
    }
  }
  result.joins_by_hash = result.joins_any_qos = identifier == "rmw_zenoh_cpp";
  if (identifier == "rmw_fastrtps_cpp" || identifier == "rmw_zenoh_cpp")
    result.takes_bare_types = result.takes_bare_services = true;
  return result;
}

const Middleware& middleware() {
  static const Middleware ours = [] {
    const std::string_view identifier = rmw_get_implementation_identifier();  // loads it
    return middleware_named(identifier, CyclonePublishers::available());
  }();
  return ours;
}

Gid Middleware::participant_of(const Gid& id) const {
  Gid participant;
  std::copy_n(id.bytes.begin(), participant_bytes, participant.bytes.begin());
  return participant;
}

Gid Middleware::caller_in_graph(const rmw_request_id_t& request, PublisherIds& ids) const {
  const Gid caller = caller_of(request);
  if (caller_named != CallerNamed::kWriterHandle) return caller;
  constexpr std::size_t kHandleBytes = 8;
  Gid handle;
  std::copy_n(caller.bytes.begin() + kHandleBytes, kHandleBytes, handle.bytes.begin());
  return ids.id_of(handle);
}

Gid caller_of(const rmw_request_id_t& request) {
  static_assert(sizeof(request.writer_guid) <= sizeof(Gid::bytes));
  Gid gid;
  std::copy(std::begin(request.writer_guid), std::end(request.writer_guid), gid.bytes.begin());
  return gid;
}

namespace {

// Adds the endpoints of one of the middleware's topics. False: they are not known.
bool add_ids(const rcl_node_t* node, const std::string& topic, EndpointQuery query,
             std::unordered_set<Gid>& ids) {
  const TopicEndpoints found(query, node, topic.c_str(), true);
  for (const auto& info : found) ids.insert(distro::gid_of(info.endpoint_gid));
  return found.ok();
}

}  // namespace

std::optional<std::unordered_set<Gid>> callers_in_graph(const rcl_node_t* node,
                                                        const std::string& service) {
  const Middleware& of = middleware();
  std::optional<std::unordered_set<Gid>> callers;
  if (!of.tells_callers()) {
    if (distro::count_clients(node, service.c_str()) == std::optional<std::size_t>{0})
      callers.emplace();
  } else {
    callers.emplace();
    // A caller behind a micro-ROS agent is identified by its writer.
    const bool reads = of.caller_named == Middleware::CallerNamed::kReader;
    const bool known =
        (!reads ||
         add_ids(node, "rr" + service + "Reply", rcl_get_subscriptions_info_by_topic, *callers)) &&
        add_ids(node, "rq" + service + "Request", rcl_get_publishers_info_by_topic, *callers);
    if (!known) callers.reset();
  }
  if (!callers) rcl_reset_error();
  return callers;
}

}  // namespace connect_bridge::ros
