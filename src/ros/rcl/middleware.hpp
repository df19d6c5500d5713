// All differences between middlewares (RMWs), and nothing else.
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
  // The id of a publisher that the middleware reports with samples, and for our own publishers
  // (rmw_get_gid_for_publisher). rmw_cyclonedds_cpp reports a handle that is valid only in this
  // process (ros2/rmw_cyclonedds#377), all others report the id of the graph.
  enum class PublisherNamed { kId, kHandle };
  PublisherNamed publisher_named = PublisherNamed::kId;

  // The number of bytes of an id that identify the participant. Ids of DDS endpoints begin with the
  // 12 bytes of their participant (RTPS 2.3 section 8.2.4), and a context has one participant. So
  // one id of ours identifies all others, including ids of endpoints that are gone. 0: ids do not
  // show the participant; rmw_zenoh_cpp makes them from hashes.
  std::size_t participant_bytes = 0;

  // The caller's id in a request. Services of DDS middlewares are pairs of topics, so the graph has
  // both endpoints of each caller. A request of rmw_fastrtps has the id of the endpoint that reads
  // responses. A request of rmw_cyclonedds_cpp has the handle of its writer, in the second half of
  // `writer_guid`. Requests of others have no id of the graph, and only "no caller at all" can be
  // detected.
  enum class CallerNamed { kNothing, kReader, kWriterHandle };
  CallerNamed caller_named = CallerNamed::kNothing;

  // False for rmw_fastrtps: a callback for lost samples can deadlock with a thread that sets or
  // takes an event (fixed by ros2/rmw_fastrtps#890). The count is then polled.
  bool lost_callback_is_safe = true;

  // False for rmw_fastrtps: it skips samples of this process while it takes, and was seen (9.3.3)
  // to lose the sample of another publisher behind one of them. All samples are then taken.
  bool ignoring_local_is_safe = true;

  // False for rmw_cyclonedds_cpp: it allocates new sequences in a message that it fills, and does
  // not free the old ones (seen in 4.0.3). The message must then be empty each time.
  bool fills_used_messages = true;

  // Whether topics, and whether services, can have types whose packages are not installed
  // (types/bare_types.hpp). rmw_fastrtps_cpp and rmw_zenoh_cpp read and write messages by functions
  // of the type support, the others by a type's fields. rmw_cyclonedds_cpp only copies serialized
  // data, such as the samples of topics; requests and responses are not serialized.
  bool takes_bare_types = false;
  bool takes_bare_services = false;

  // rmw_cyclonedds_cpp accepts only a type support that shows a type's fields.
  bool asks_for_fields = false;

  // rmw_zenoh_cpp connects the endpoints of a topic or service only if their type hashes are equal.
  bool joins_by_hash = false;

  // rmw_zenoh_cpp connects a publisher with a subscriber whatever the QoS of the two.
  bool joins_any_qos = false;

  // The publisher of a sample can be found in the graph.
  [[nodiscard]] bool tells_origins() const {
    return publisher_named == PublisherNamed::kId || participant_bytes > 0;
  }
  [[nodiscard]] bool tells_callers() const { return caller_named != CallerNamed::kNothing; }
  // The graph's writers of responses show all servers, and ids show which of them are ours.
  [[nodiscard]] bool tells_servers() const { return participant_bytes > 0; }
  // The beginning of the ids of all endpoints of a process; all zero if ids do not show it.
  [[nodiscard]] Gid participant_of(const Gid& id) const;
  // The caller of a request, comparable with callers_in_graph().
  [[nodiscard]] Gid caller_in_graph(const rmw_request_id_t& request, PublisherIds& ids) const;
};

// The properties of the middleware with this identifier. `finds_handles`: publishers can be found
// by their handles (CyclonePublishers); otherwise ids cannot be used.
Middleware middleware_named(std::string_view identifier, bool finds_handles);
// The middleware of this process. Call it only after rcl was initialized.
const Middleware& middleware();

// The caller of a request, as the middleware identifies it.
Gid caller_of(const rmw_request_id_t& request);

// All callers in the graph that may have sent requests to this service (a full name); nullopt: this
// middleware does not show them, or failed.
std::optional<std::unordered_set<Gid>> callers_in_graph(const rcl_node_t* node,
                                                        const std::string& service);

}  // namespace connect_bridge::ros
