// /diagnostics of this process: anybody's, in a graph whose other own endpoints are not seen.
#include "core/base/cdr.hpp"
#include "ros/ros_fixture.hpp"
#include "ros/topics/diagnostics_topic.hpp"

namespace connect_bridge::ros {
namespace {

class DiagnosticsTest : public RosTest {
 protected:
  static Payload sample() {
    CdrWriter to;
    to.u32(1).u32(2).string("").u32(0);
    return to.take();
  }
};

// A subscription of this process, as of a peer that listens, gets it; mirrors are left out as ever.
TEST_F(DiagnosticsTest, IsExportedAsThatOfAnyNode) {
  TestSide side("connect_server");
  ASSERT_EQ(side.gateway.open_diagnostics(), "");
  EXPECT_FALSE(side.gateway.diagnostics_wanted());
  const auto seen = side.topic_state(
      kDiagnosticsTopic, [](const TopicState& topic) { return topic.publishers.size() == 1; });
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->type, kDiagnosticsType);
  EXPECT_EQ(seen->publishers[0].node_name, "connect_server");
  side.gateway.apply(CreateMirror{kMirror, kDiagnosticsTopic, kDiagnosticsType, seen->type_hash,
                                  qos_of_depth(10)});
  side.gateway.apply(CreateSubscription{kSubscription, kDiagnosticsTopic, kDiagnosticsType,
                                        seen->type_hash, qos_of_depth(10)});
  ASSERT_TRUE(side.until([&] { return side.gateway.diagnostics_wanted(); }));
  side.gateway.apply(Publish{kMirror, sample()});
  std::optional<MessageTaken> taken;
  ASSERT_TRUE(side.until([&] {
    side.gateway.publish_diagnostics(sample().view());
    taken = side.next<MessageTaken>(std::chrono::milliseconds(100));
    return taken.has_value();
  }));
  EXPECT_EQ(taken->origin, seen->publishers[0].gid);
  EXPECT_EQ(bytes_of(taken->payload), bytes_of(sample()));
}

}  // namespace
}  // namespace connect_bridge::ros
