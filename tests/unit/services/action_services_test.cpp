// The services of one action: one peer serves them all.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "unit/services/calls_script.hpp"

namespace connect_bridge::side_test {
namespace {

class ActionServices : public ::testing::Test {
 protected:
  ActionServices() : s_(server({acting()})) {
    s_.graph({});
    s_.pass(kDiscovered);
    for (const std::uint32_t peer : {1, 2}) s_.join(peer);
  }

  static Rule acting() {
    Rule rule = callable();
    rule.opens[Direction::kImport][OpenedBy::kActions] = {Pattern::parse("/**").value()};
    return rule;
  }

  static ChannelOffer part(std::uint32_t channel, const std::string& name) {
    ChannelOffer offer = service_channel(channel, "/go/_action/" + name);
    offer.type = name == "cancel_goal"  ? "action_msgs/srv/CancelGoal"
                 : name == "get_result" ? "p/action/Go_GetResult"
                                        : "p/action/Go_SendGoal";
    offer.action_type = "p/action/Go";
    return offer;
  }

  Script s_;
};

const std::string kAll = "attach 1 1\nattach 2 2\nattach 3 3\n";

// Its offer may have come while its action server was being made.
TEST_F(ActionServices, ACancelGoesWhereTheGoalsGo) {
  s_.say(1, Offer{{part(1, "cancel_goal")}, true});
  EXPECT_EQ(s_.said(1), "attach 1 1\n");
  s_.say(2, Offer{{part(1, "cancel_goal"), part(2, "get_result"), part(3, "send_goal")}, true});
  EXPECT_EQ(s_.said(1), "withdraw 1\n");
  EXPECT_EQ(s_.said(2), "attach 2 1\nattach 3 2\nattach 1 3\n");
  s_.say(1, Offer{{part(2, "get_result"), part(3, "send_goal")}, false});
  EXPECT_EQ(s_.said(1), "");
}

TEST_F(ActionServices, WithTheGoalsTheOthersMove) {
  for (const std::uint32_t peer : {1, 2})
    s_.say(peer,
           Offer{{part(1, "send_goal"), part(2, "get_result"), part(3, "cancel_goal")}, true});
  EXPECT_EQ(s_.said(1), kAll);
  EXPECT_EQ(s_.said(2), "");
  s_.say(1, Withdraw{{{1}}});
  EXPECT_EQ(s_.said(1), "withdraw 1\nwithdraw 3\nwithdraw 2\n");
  EXPECT_EQ(s_.said(2), "attach 1 1\nattach 3 2\nattach 2 3\n");
}

// It would stop nothing, and seem to work.
TEST_F(ActionServices, WhoHasNoGoalsHereIsNotAskedToCancelThem) {
  s_.say(1, Offer{{part(1, "send_goal")}, true});
  s_.say(2, Offer{{part(1, "cancel_goal")}, true});
  EXPECT_EQ(s_.said(1), "attach 1 1\n");
  EXPECT_EQ(s_.said(2), "");
  s_.say(1, Withdraw{{{1}}});
  EXPECT_EQ(s_.said(2), "attach 1 1\n");
}

// All types of a part are looked at together: a peer that names thousands makes no work for this
// side.
TEST_F(ActionServices, APartHasFewTypes) {
  std::vector<ChannelOffer> types;
  for (std::uint32_t n = 1; n <= 6; ++n) {
    types.push_back(part(n, "send_goal"));
    types.back().type = "p/action/Go" + std::to_string(n) + "_SendGoal";
    types.back().action_type = "p/action/Go" + std::to_string(n);
  }
  s_.say(1, Offer{types, true});
  EXPECT_EQ(s_.said(1),
            "attach 1 1\nattach 2 2\nattach 3 3\nattach 4 4\ndecline 5 limit\ndecline 6 limit\n");
  s_.say(2, Offer{{types[0], types[5]}, true});  // another link of the same identity
  EXPECT_EQ(s_.said(2), "decline 6 limit\n");
  s_.say(1, Withdraw{{{2}}});
  s_.say(1, Offer{{part(7, "send_goal")}, false});
  EXPECT_EQ(s_.said(1), "withdraw 2\nattach 7 5\n");
}

// Goals whose definition differs go nowhere, and bind nobody.
TEST_F(ActionServices, GoalsThatCannotBeTakenBindNobody) {
  s_.say(1, Offer{{part(1, "send_goal")}, true});
  s_.say(1, Attached{{1}, {1}, {0}, {}, "there"});
  s_.pass(2000);
  s_.give(ServiceMirrorFailed{{1}, "type_mismatch", "differs", "here"});
  s_.said(1);
  s_.say(2, Offer{{part(1, "cancel_goal"), part(2, "send_goal")}, true});
  EXPECT_EQ(s_.said(1), "");
  EXPECT_EQ(s_.said(2), "attach 1 1\nattach 2 2\n");
}

}  // namespace
}  // namespace connect_bridge::side_test
