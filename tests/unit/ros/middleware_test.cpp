// How differences between middlewares are handled.
#include "ros/rcl/middleware.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "ros/rcl/publisher_ids.hpp"

namespace connect_bridge::ros {
namespace {

Gid counting() {
  Gid gid;
  for (std::size_t i = 0; i < gid.bytes.size(); ++i)
    gid.bytes[i] = static_cast<std::uint8_t>(i + 1);
  return gid;
}

rmw_request_id_t counting_request() {
  rmw_request_id_t request{};
  for (std::size_t i = 0; i < sizeof request.writer_guid; ++i)
    request.writer_guid[i] = static_cast<std::int8_t>(i + 1);
  return request;
}

Gid first_twelve() {
  Gid gid;
  std::copy_n(counting().bytes.begin(), 12, gid.bytes.begin());
  return gid;
}

TEST(Middleware, FastDdsTellsAll) {
  const auto of = middleware_named("rmw_fastrtps_dynamic_cpp", false);
  EXPECT_EQ(of.publisher_named, Middleware::PublisherNamed::kId);
  EXPECT_TRUE(of.tells_callers() && of.tells_servers());
  EXPECT_FALSE(of.lost_callback_is_safe);
  EXPECT_FALSE(of.ignoring_local_is_safe);
  EXPECT_TRUE(of.fills_used_messages);
  EXPECT_EQ(of.participant_of(counting()), first_twelve());
  PublisherIds ids;
  EXPECT_EQ(of.caller_in_graph(counting_request(), ids), caller_of(counting_request()));
}

TEST(Middleware, CycloneTellsHandlesOfPublishersAndCallers) {
  const auto of = middleware_named("rmw_cyclonedds_cpp", true);
  EXPECT_EQ(of.publisher_named, Middleware::PublisherNamed::kHandle);
  EXPECT_TRUE(of.tells_callers() && of.tells_servers() && of.lost_callback_is_safe);
  EXPECT_FALSE(of.fills_used_messages);
  PublisherIds ids([] {
    Gid handle;  // the second half of counting_request()
    for (std::size_t i = 0; i < 8; ++i) handle.bytes[i] = static_cast<std::uint8_t>(i + 9);
    return std::vector<PublisherChange>{{handle, counting(), false}};
  });
  EXPECT_EQ(of.caller_in_graph(counting_request(), ids), counting());
}

// Without knowing our own ids, we would mistake our own servers for others'.
TEST(Middleware, CycloneWhoseHandlesCannotBeFoundTellsNothing) {
  const auto of = middleware_named("rmw_cyclonedds_cpp", false);
  EXPECT_EQ(of.publisher_named, Middleware::PublisherNamed::kHandle);
  EXPECT_FALSE(of.tells_origins() || of.tells_callers() || of.tells_servers());
  EXPECT_EQ(of.participant_of(counting()), Gid{});
  EXPECT_TRUE(middleware_named("rmw_cyclonedds_cpp", true).tells_origins());
  EXPECT_TRUE(middleware_named("rmw_zenoh_cpp", false).tells_origins());
}

TEST(Middleware, OthersTellIdsAndNoMore) {
  for (const char* name : {"rmw_zenoh_cpp", "rmw_connextdds", "rmw_of_tomorrow"}) {
    const auto of = middleware_named(name, true);
    EXPECT_EQ(of.publisher_named, Middleware::PublisherNamed::kId) << name;
    EXPECT_FALSE(of.tells_callers() || of.tells_servers()) << name;
    EXPECT_EQ(of.participant_of(counting()), Gid{}) << name;
  }
}

TEST(Middleware, TypesThatAreNotInstalledNeedTheTypeSupportOfFastRtps) {
  for (const char* name : {"rmw_fastrtps_cpp", "rmw_zenoh_cpp"}) {
    const auto of = middleware_named(name, false);
    EXPECT_TRUE(of.takes_bare_types && of.takes_bare_services && !of.asks_for_fields) << name;
  }
  const auto zenoh = middleware_named("rmw_zenoh_cpp", false);
  EXPECT_TRUE(zenoh.joins_by_hash && zenoh.joins_any_qos);
  for (const char* name : {"rmw_fastrtps_dynamic_cpp", "rmw_of_tomorrow"}) {
    const auto of = middleware_named(name, true);
    EXPECT_FALSE(of.takes_bare_types || of.takes_bare_services || of.asks_for_fields) << name;
    EXPECT_FALSE(of.joins_by_hash || of.joins_any_qos) << name;
  }
}

TEST(Middleware, CycloneCopiesTheSamplesOfTopicsAndReadsRequestsByTheirFields) {
  const auto of = middleware_named("rmw_cyclonedds_cpp", true);
  EXPECT_TRUE(of.takes_bare_types && of.asks_for_fields);
  EXPECT_FALSE(of.takes_bare_services || of.joins_by_hash);
}

}  // namespace
}  // namespace connect_bridge::ros
