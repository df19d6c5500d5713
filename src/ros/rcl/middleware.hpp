// Everything that differs between middlewares (RMWs), and nothing else.
#pragma once

#include <rcl/node.h>
#include <rmw/types.h>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_set>

#include "core/base/ids.hpp"

namespace connect_bridge::ros {

class PublisherIds;

struct Middleware {
  // How the middleware identifies a publisher, with its samples and for our own
  // (rmw_get_gid_for_publisher). rmw_cyclonedds_cpp gives a handle that is valid in this process
  // only (ros2/rmw_cyclonedds#377), all others give the id of the graph.
  enum class PublisherTold { kId, kHandle };
  PublisherTold publisher_told = PublisherTold::kId;

  // The ids of DDS endpoints begin with the 12 bytes of their participant (RTPS 2.3 section 8.2.4),
  // and a context has one participant. So one id of ours identifies all others, including those of
  // endpoints that are gone. rmw_zenoh_cpp makes ids from hashes, which show nothing. 0: ids do not
  // show the participant.
  std::size_t participant_bytes = 0;

  // How a request identifies its caller. The services of DDS middlewares are pairs of topics, so
  // the graph has both endpoints of each caller. With rmw_fastrtps a request has the id of the
  // endpoint that reads responses; with rmw_cyclonedds_cpp the handle of the one that wrote it, in
  // the second half of `writer_guid`; with others it has nothing that is in the graph, and only "no
  // caller at all" can be found.
  enum class CallerTold { kNothing, kReader, kWriterHandle };
  CallerTold caller_told = CallerTold::kNothing;

  // rmw_fastrtps can deadlock between a lost sample and a thread that sets or takes an event, once
  // a callback for lost samples is set (fixed by ros2/rmw_fastrtps#890). There the count is polled
  // instead.
  bool lost_callback_is_safe = true;

  // rmw_fastrtps skips samples of this process while it takes, and was seen (9.3.3) to lose the
  // sample of another publisher that waits behind one of them. There all are taken.
  bool ignoring_local_is_safe = true;

  // rmw_cyclonedds_cpp allocates new sequences in a message that it fills, and does not free those
  // that are in it (seen in 4.0.3): it must get an empty message each time.
  bool fills_used_messages = true;

  // Whether topics, and whether services, can have types whose packages are not installed
  // (types/bare_types.hpp). rmw_fastrtps_cpp and rmw_zenoh_cpp read and write messages by functions
  // of the type support, the others by a type's fields. Of these rmw_cyclonedds_cpp only copies
  // what is serialized already, as the samples of topics are; requests and responses are not.
  bool takes_bare_types = false;
  bool takes_bare_services = false;

  // rmw_cyclonedds_cpp takes no other type support than one that shows a type's fields.
  bool asks_for_fields = false;

  // rmw_zenoh_cpp connects the endpoints of a topic or service only if their type hashes are equal.
  bool joins_by_hash = false;

  // rmw_zenoh_cpp connects a publisher with a subscriber whatever the QoS of the two.
  bool joins_any_qos = false;

  // Whether it can be found which publisher of the graph a sample is of.
  [[nodiscard]] bool tells_origins() const {
    return publisher_told == PublisherTold::kId || participant_bytes > 0;
  }
  [[nodiscard]] bool tells_callers() const { return caller_told != CallerTold::kNothing; }
  // Whether the graph's writers of responses show all servers, and ids show which of them are ours.
  [[nodiscard]] bool tells_servers() const { return participant_bytes > 0; }
  // The beginning of the ids of all endpoints of a process; all zero where ids do not show it.
  [[nodiscard]] Gid participant_of(const Gid& id) const;
  // The caller of a request, comparable with callers_in_graph().
  [[nodiscard]] Gid caller_in_graph(const rmw_request_id_t& request, PublisherIds& ids) const;
};

// The properties of the middleware with this identifier. `finds_handles`: publishers can be found
// by their handles (CyclonePublishers); without that ids cannot be used.
Middleware middleware_named(std::string_view identifier, bool finds_handles);
// The middleware of this process; not before rcl is initialized.
const Middleware& middleware();

// The caller of a request, as the middleware identifies it.
Gid caller_of(const rmw_request_id_t& request);

// All callers in the graph that may have sent requests to this service (a full name); nullopt: this
// middleware does not show them, or failed.
std::optional<std::unordered_set<Gid>> callers_in_graph(const rcl_node_t* node,
                                                        const std::string& service);

}  // namespace connect_bridge::ros
