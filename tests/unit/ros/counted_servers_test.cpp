// The owners of servers, where the middleware only counts them.
#include "ros/graph/counted_servers.hpp"

#include <gtest/gtest.h>

namespace connect_bridge::ros {
namespace {

const NodeName kArm{"/", "arm"}, kBase{"/fleet", "base"}, kTalker{"/", "talker"};
constexpr const char* kSetBool = "std_srvs/srv/SetBool";
constexpr const char* kEmpty = "std_srvs/srv/Empty";
using Counted = std::map<std::string, CountedService>;

ServiceOwners with(ServiceOwners owners, const Counted& counted,
                   const std::map<std::string, std::size_t>& ours,
                   const std::set<NodeName>& shared) {
  add_counted_owners(owners, counted, ours, shared);
  return owners;
}

TEST(CountedServers, WhatNobodyKnownHasBelongsToASharedName) {
  const Counted counted{{"/go", {{kSetBool}, 1}}};
  EXPECT_EQ(with({}, counted, {}, {kArm}), (ServiceOwners{{{"/go", kSetBool}, {kArm}}}));
  EXPECT_EQ(with({}, counted, {}, {}), ServiceOwners{});
}

TEST(CountedServers, OursAndThoseOfKnownNodesBelongToNobodyElse) {
  const ServiceOwners known{{{"/go", kSetBool}, {kTalker}}};
  EXPECT_EQ(with(known, {{"/go", {{kSetBool}, 2}}}, {{"/go", 1}}, {kArm}), known);
  EXPECT_EQ(with({}, {{"/stop", {{kSetBool}, 1}}}, {{"/stop", 2}}, {kArm}), ServiceOwners{});
}

TEST(CountedServers, OneMoreThanIsKnownBelongsToASharedName) {
  EXPECT_EQ(
      with({{{"/go", kSetBool}, {kTalker}}}, {{"/go", {{kSetBool}, 3}}}, {{"/go", 1}}, {kArm}),
      (ServiceOwners{{{"/go", kSetBool}, {kArm, kTalker}}}));
}

TEST(CountedServers, ANameBelowTheNodesSaysWhoseItIs) {
  EXPECT_EQ(with({}, {{"/fleet/base/reset", {{kEmpty}, 1}}}, {}, {kArm, kBase}),
            (ServiceOwners{{{"/fleet/base/reset", kEmpty}, {kBase}}}));
  EXPECT_EQ(with({}, {{"/fleet/base_2/reset", {{kEmpty}, 1}}}, {}, {kArm, kBase}),
            (ServiceOwners{{{"/fleet/base_2/reset", kEmpty}, {kArm}}}));
}

TEST(CountedServers, OfTwoTypesTheOneWithoutAnOwnerIsTheUnknownServers) {
  const ServiceOwners known{{{"/go", kSetBool}, {kTalker}}};
  for (const auto& types :
       {std::vector<std::string>{kEmpty, kSetBool}, std::vector<std::string>{kSetBool, kEmpty}}) {
    EXPECT_EQ(with(known, {{"/go", {types, 2}}}, {}, {kArm}),
              (ServiceOwners{{{"/go", kSetBool}, {kTalker}}, {{"/go", kEmpty}, {kArm}}}));
  }
}

// Two nodes of one name, both with the same service, are one owner.
TEST(CountedServers, ANamesakesServerIsNotGivenToAnotherName) {
  const ServiceOwners known{{{"/go", kSetBool}, {kTalker}}};
  EXPECT_EQ(with(known, {{"/go", {{kSetBool}, 2}}}, {}, {kArm, kTalker}), known);
}

}  // namespace
}  // namespace connect_bridge::ros
