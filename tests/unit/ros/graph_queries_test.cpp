// Queries that answer as rcl does, and fail as it may: in the middle.
#include "ros/rcl/graph_queries.hpp"

#include <gtest/gtest.h>
#include <rcutils/strdup.h>
#include <rmw/names_and_types.h>
#include <rmw/topic_endpoint_info_array.h>

#include <string>
#include <vector>

namespace connect_bridge::ros {
namespace {

using Array = rcl_topic_endpoint_info_array_t;

// Two endpoints, whose types are the topic and the kind of its name.
rcl_ret_t two_endpoints(const rcl_node_t*, rcl_allocator_t* allocator, const char* topic,
                        bool of_middleware, Array* found) {
  EXPECT_EQ(RMW_RET_OK, rmw_topic_endpoint_info_array_init_with_size(found, 2, allocator));
  for (const char* type : {topic, of_middleware ? "middleware" : "ros"})
    EXPECT_EQ(RMW_RET_OK, rmw_topic_endpoint_info_set_topic_type(
                              &found->info_array[type == topic ? 0 : 1], type, allocator));
  return RCL_RET_OK;
}

rcl_ret_t failing_endpoints(const rcl_node_t*, rcl_allocator_t*, const char*, bool, Array* found) {
  found->size = 3;  // of an array that is not there
  return RCL_RET_ERROR;
}

std::vector<std::string> types_of(const TopicEndpoints& endpoints) {
  std::vector<std::string> types;
  for (const auto& info : endpoints) types.emplace_back(info.topic_type);
  return types;
}

// One name with this many types: "type", "type", ...
rcl_ret_t one_name(const rcl_node_t*, rcl_allocator_t* allocator, std::size_t types,
                   rcl_names_and_types_t* found) {
  EXPECT_EQ(RMW_RET_OK, rmw_names_and_types_init(found, 1, allocator));
  found->names.data[0] = rcutils_strdup("/chatter", *allocator);
  EXPECT_EQ(RCUTILS_RET_OK, rcutils_string_array_init(&found->types[0], types, allocator));
  for (std::size_t i = 0; i < types; ++i)
    found->types[0].data[i] = rcutils_strdup("type", *allocator);
  return RCL_RET_OK;
}

rcl_ret_t no_names(const rcl_node_t*, rcl_allocator_t*, rcl_names_and_types_t* found) {
  found->names.size = 3;
  return RCL_RET_ERROR;
}

TEST(GraphQueriesTest, GivesTheEndpointsOfATopic) {
  const TopicEndpoints endpoints(&two_endpoints, nullptr, "/chatter");
  EXPECT_TRUE(endpoints.ok());
  EXPECT_EQ((std::vector<std::string>{"/chatter", "ros"}), types_of(endpoints));
  EXPECT_EQ((std::vector<std::string>{"rt/chatter", "middleware"}),
            types_of(TopicEndpoints(&two_endpoints, nullptr, "rt/chatter", true)));
}

TEST(GraphQueriesTest, HasNoEndpointsIfTheMiddlewareFails) {
  const TopicEndpoints endpoints(&failing_endpoints, nullptr, "/chatter");
  EXPECT_FALSE(endpoints.ok());
  EXPECT_TRUE(types_of(endpoints).empty());
}

TEST(GraphQueriesTest, GivesNamesWithTheirTypes) {
  for (const std::size_t count : {0U, 1U, 2U}) {
    const NamesAndTypes found(&one_name, nullptr, count);
    EXPECT_TRUE(found.ok());
    ASSERT_EQ(1U, found.size());
    EXPECT_STREQ("/chatter", found.name(0));
    const std::vector<std::string> types(found.types(0).begin(), found.types(0).end());
    EXPECT_EQ(std::vector<std::string>(count, "type"), types);
  }
}

TEST(GraphQueriesTest, HasNoNamesIfTheMiddlewareFails) {
  const NamesAndTypes found(&no_names, nullptr);
  EXPECT_FALSE(found.ok());
  EXPECT_EQ(0U, found.size());
}

}  // namespace
}  // namespace connect_bridge::ros
