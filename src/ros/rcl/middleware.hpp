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
  // What is told of a publisher, with its samples and of our own (rmw_get_gid_for_publisher).
  // rmw_cyclonedds_cpp tells a handle that only this process knows (ros2/rmw_cyclonedds#377), all
  // others the id of the graph.
  enum class PublisherTold { kId, kHandle };
  PublisherTold publisher_told = PublisherTold::kId;

  // The ids of DDS endpoints begin with the 12 bytes of their participant (RTPS 2.3 section 8.2.4),
  // and a context has one participant. So one id of ours tells all others, those of endpoints that
  // are gone included. rmw_zenoh_cpp makes ids of hashes, which tell nothing. 0: they do not tell.
  std::size_t participant_bytes = 0;

  // How a request tells its caller. The services of DDS middlewares are pairs of topics, so the
  // graph has both ends of each caller. With rmw_fastrtps a request has the id of the one that
  // reads responses; with rmw_cyclonedds_cpp the handle of the one that wrote it, in the second
  // half of `writer_guid`; with others it has nothing that is in the graph, and there only "nobody
  // at all" is known.
  enum class CallerTold { kNothing, kReader, kWriterHandle };
  CallerTold caller_told = CallerTold::kNothing;

  // rmw_fastrtps can deadlock between a lost sample and whoever sets or takes an event, once a
  // callback for lost samples is set (fixed by ros2/rmw_fastrtps#890). There the count is asked for
  // instead.
  bool lost_callback_is_safe = true;

  // rmw_cyclonedds_cpp makes the sequences of a message that it fills anew, and does not free those
  // that are in it (seen in 4.0.3): it must get an empty one each time.
  bool fills_used_messages = true;

  // Whether endpoints can be made of types whose packages are not installed (types/bare_types.hpp):
  // these middlewares read and write messages by functions that type support brings with it, and
  // the others by a type's fields.
  bool takes_bare_types = false;

  // rmw_zenoh_cpp joins the endpoints of a topic or service only where their hashes are the same.
  bool joins_by_hash = false;

  [[nodiscard]] bool tells_callers() const { return caller_told != CallerTold::kNothing; }
  // Whether the writers of responses in the graph tell all servers, and ids which of them are ours.
  [[nodiscard]] bool tells_servers() const { return participant_bytes > 0; }
  // What the ids of all endpoints of a process begin with; all zero where ids do not tell.
  [[nodiscard]] Gid participant_of(const Gid& id) const;
  // Who sent a request, comparable with callers_in_graph().
  [[nodiscard]] Gid caller_in_graph(const rmw_request_id_t& request, PublisherIds& ids) const;
};

// Of the middleware with this identifier. `finds_handles`: publishers are found by their handles
// (CyclonePublishers); without that nothing can be made of ids.
Middleware middleware_named(std::string_view identifier, bool finds_handles);
// Of this process; not before rcl is initialized.
const Middleware& middleware();

// Who sent a request, as the middleware tells it.
Gid caller_of(const rmw_request_id_t& request);

// Everyone in the graph who may have sent requests to this service (a full name); nullopt: this
// middleware does not tell, or failed.
std::optional<std::unordered_set<Gid>> callers_in_graph(const rcl_node_t* node,
                                                        const std::string& service);

}  // namespace connect_bridge::ros
