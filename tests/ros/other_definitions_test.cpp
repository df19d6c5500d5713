// Types that are installed here with another definition than the peer's.
#include <gtest/gtest.h>

#include "ros/gateway.hpp"
#include "ros/rcl/distro.hpp"
#include "ros/service_fixture.hpp"

namespace connect_bridge::ros {
namespace {

#if CONNECT_TYPE_HASHES

const std::string kPackage = kTestPackage;
const std::string kOtherHash = "RIHS01_" + std::string(64, 'a');

class OtherDefinitionsTest : public RosTest {
 protected:
  // Whether a sample of the mirror could be published.
  static bool publishes(TestSide& side, const Bytes& sample) {
    const auto before = side.gateway.counters().published;
    side.gateway.apply(Publish{MirrorId{1}, Payload::adopt(Bytes(sample))});
    return side.gateway.counters().published > before;
  }
};

TEST_F(OtherDefinitionsTest, OneOfATopicIsUsedWhereThatIsAllowed) {
  const std::string type = kPackage + "/msg/Blob";
  TestSide side("connect_client");
  CreateMirror create{MirrorId{1}, topic("blob"), type, kOtherHash, qos_of_depth(10)};
  side.gateway.apply(create);
  const auto failed = side.next<MirrorFailed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ(failed->code, "type_mismatch");
  TypeSupports types;
  EXPECT_EQ(failed->hash_here, distro::type_hash_of(*std::get<0>(types.message(type, "")).handle));
  create.any_definition = true;
  side.gateway.apply(create);
  EXPECT_EQ(side.next<TypeDiffers>()->hash_here, failed->hash_here);
  EXPECT_TRUE(publishes(side, Cdr{}.u64(1).u64(2).u32(3).zeros(3).bytes()));
  // Small ones are checked too: who sends them has another definition.
  EXPECT_FALSE(publishes(side, Cdr{}.u64(1).u64(2).u32(30).zeros(3).bytes()));
}

TEST_F(OtherDefinitionsTest, OneOfAServiceLikewise) {
  TestSide side("connect_client");
  CreateServiceMirror create{ServiceMirrorId{1}, topic("echo"), kPackage + "/srv/Echo", kOtherHash};
  side.gateway.apply(create);
  const auto failed = side.next<ServiceMirrorFailed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ(failed->code, "type_mismatch");
  EXPECT_EQ(failed->hash_here, std::get<0>(TypeSupports().service(create.type, ""))->hash);
  create.id = ServiceMirrorId{2};
  create.any_definition = true;
  side.gateway.apply(create);
  EXPECT_EQ(side.next<ServiceTypeDiffers>()->hash_here, failed->hash_here);
}

#endif

}  // namespace
}  // namespace connect_bridge::ros
