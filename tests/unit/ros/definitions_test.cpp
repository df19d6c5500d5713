// Endpoints of a service's requests, as the graph of a DDS middleware shows them.
#include "ros/services/definitions.hpp"

#include <gtest/gtest.h>
#include <rmw/types.h>

#include <vector>

#include "ros/types/hashed.hpp"

namespace connect_bridge::ros {
namespace {

#if CONNECT_TYPE_HASHES

constexpr char kType[] = "std_srvs::srv::dds_::SetBool_Request_";

std::string hash_of(char digit) {
  return "RIHS01_" + std::string(64, digit);
}

class DefinitionsTest : public testing::Test {
 protected:
  // `hash`: empty for a node of another kind.
  void endpoint(const char* node, const std::string& hash, const char* type = kType) {
    auto info = rmw_get_zero_initialized_topic_endpoint_info();
    info.node_name = node;
    info.node_namespace = "/";
    info.topic_type = type;
    info.topic_type_hash = parse_type_hash(hash).value();
    info.endpoint_gid[0] = static_cast<std::uint8_t>(endpoints_.size() + 1);
    endpoints_.push_back(info);
  }
  PartSeen look(const std::string& hash_here = hash_of('a')) {
    return definitions_of(endpoints_, own_, {"std_srvs/srv/SetBool_Request", hash_here});
  }
  std::string other(const PartSeen& seen) { return seen.other ? seen.other->node_name : ""; }

  OwnEndpoints own_{0};
  std::vector<rmw_topic_endpoint_info_t> endpoints_;
};

TEST_F(DefinitionsTest, NobodyIsNotKnown) {
  EXPECT_FALSE(look().known);
}

TEST_F(DefinitionsTest, TheSameDefinitionIsNoOther) {
  endpoint("arm", hash_of('a'));
  EXPECT_TRUE(look().known);
  EXPECT_EQ("", other(look()));
}

TEST_F(DefinitionsTest, TheFirstOtherDefinitionIsTold) {
  endpoint("arm", hash_of('a'));
  endpoint("leg", hash_of('b'));
  endpoint("head", hash_of('c'));
  EXPECT_TRUE(look().known);
  EXPECT_EQ("leg", other(look()));
}

TEST_F(DefinitionsTest, WithoutAHashNothingIsTold) {
  endpoint("micro", "");
  EXPECT_TRUE(look().known);
  EXPECT_EQ("", other(look()));
  endpoint("arm", hash_of('b'));
  EXPECT_EQ("", other(look("")));
}

// A bridge on whose machine the type is not installed.
TEST_F(DefinitionsTest, NobodysHashIsNone) {
  endpoint("connect_client", nobodys_hash());
  EXPECT_TRUE(look().known);
  EXPECT_EQ("", other(look()));
}

TEST_F(DefinitionsTest, AnotherTypeIsNoOtherDefinition) {
  endpoint("arm", hash_of('b'), "std_srvs::srv::dds_::Trigger_Request_");
  EXPECT_EQ("", other(look()));
}

TEST_F(DefinitionsTest, OurOwnEndpointsDoNotCount) {
  endpoint("connect_server", hash_of('b'));
  own_.add(distro::gid_of(endpoints_[0].endpoint_gid));
  EXPECT_FALSE(look().known);
  EXPECT_EQ("", other(look()));
}

// It arrives some time after the endpoints.
TEST_F(DefinitionsTest, TheNameOfANodeIsWaitedFor) {
  endpoint("arm", hash_of('a'));
  endpoint("_NODE_NAME_UNKNOWN_", hash_of('b'));
  EXPECT_FALSE(look().known);
  EXPECT_EQ("", other(look()));
  endpoints_[1].node_name = "leg";
  EXPECT_TRUE(look().known);
  EXPECT_EQ("leg", other(look()));
}

#endif

}  // namespace
}  // namespace connect_bridge::ros
