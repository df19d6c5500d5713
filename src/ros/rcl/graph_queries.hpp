// Results of rcl's queries about the graph, which free themselves.
#pragma once

#include <rcl/graph.h>

#include <cstddef>
#include <span>

#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {

using EndpointQuery = decltype(&rcl_get_publishers_info_by_topic);

// The endpoints of a topic: `for (const auto& info : endpoints)`. Empty if the query failed.
class TopicEndpoints {
 public:
  // `query`: rcl_get_publishers_info_by_topic or rcl_get_subscriptions_info_by_topic.
  // `of_middleware`: `topic` is a name of the middleware ("rr/set_boolReply").
  TopicEndpoints(EndpointQuery query, const rcl_node_t* node, const char* topic,
                 bool of_middleware = false)
      : ok_(ignore_error(query(node, &allocator_, topic, of_middleware, &found_))) {}
  ~TopicEndpoints() {
    if (ok_) ignore_error(rcl_topic_endpoint_info_array_fini(&found_, &allocator_));
  }
  TopicEndpoints(const TopicEndpoints&) = delete;
  TopicEndpoints& operator=(const TopicEndpoints&) = delete;

  // False: the middleware failed.
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] const rcl_topic_endpoint_info_t* begin() const { return found_.info_array; }
  [[nodiscard]] const rcl_topic_endpoint_info_t* end() const {
    return begin() + (ok_ ? found_.size : 0);
  }

 private:
  rcl_allocator_t allocator_ = rcl_get_default_allocator();
  rcl_topic_endpoint_info_array_t found_ = rcl_get_zero_initialized_topic_endpoint_info_array();
  const bool ok_;
};

// Topics or services with their types. Empty if the query failed.
class NamesAndTypes {
 public:
  // `query`: rcl_get_topic_names_and_types or a similar one. `more`: its arguments between the
  // allocator and the result.
  template <class Query, class... More>
  explicit NamesAndTypes(Query query, const rcl_node_t* node, More... more)
      : ok_(ignore_error(query(node, &allocator_, more..., &found_))) {}
  ~NamesAndTypes() {
    if (ok_) ignore_error(rcl_names_and_types_fini(&found_));
  }
  NamesAndTypes(const NamesAndTypes&) = delete;
  NamesAndTypes& operator=(const NamesAndTypes&) = delete;

  // False: the middleware failed.
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t size() const { return ok_ ? found_.names.size : 0; }
  [[nodiscard]] const char* name(std::size_t i) const { return found_.names.data[i]; }
  [[nodiscard]] std::span<const char* const> types(std::size_t i) const {
    return {found_.types[i].data, found_.types[i].size};
  }

 private:
  rcl_allocator_t allocator_ = rcl_get_default_allocator();
  rcl_names_and_types_t found_ = rcl_get_zero_initialized_names_and_types();
  const bool ok_;
};

}  // namespace connect_bridge::ros
