// Each login has its interfaces below its own name: two robots of one kind at one server.
#include <gtest/gtest.h>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

struct NamedRobots : Script {
  NamedRobots() : Script(options()) {
    graph({});
    for (const std::uint32_t n : {1U, 2U}) {
      login(n, {}, {"robot" + std::to_string(n), {}});
      say(n, Accepts{{{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}}}, {}});
      said(n);
    }
    pass(2000);
    did();
  }
  static SideOptions options() {
    Rule rule = everything();
    rule.opens[Direction::kImport][OpenedBy::kServices] =
        rule.opens[Direction::kExport][OpenedBy::kServices] = {Pattern::parse("/**").value()};
    rule.opens[Direction::kImport][OpenedBy::kParameters] =
        rule.opens[Direction::kExport][OpenedBy::kParameters] =
            rule.opens[Direction::kImport][OpenedBy::kServices];
    SideOptions result = server({rule});
    result.names = PeerNames({{"robot-9", "nine"}}, {{"/tf", "/tf"}});
    result.proxy_nodes = true;
    return result;
  }
  void offer_from_both(const ChannelOffer& offer) {
    for (const std::uint32_t n : {1U, 2U}) say(n, Offer{{offer}, true});
  }
  // A login that says its name, and what comes of it.
  std::string log_in_as(std::uint32_t connection, const std::string& name) {
    give(ConnectionOpened{{connection}, "10.0.0.9"});
    binary(connection, encode(Hello{1, 1, peer_id(connection), {}, "/peer"}));
    binary(connection, encode(Login{"none", {}}));
    logged.clear();
    give(Authenticated{{connection}, Identity{name, {}}, ""});
    return did();
  }
};

bool tells_line(const std::string& text, const std::string& line) {
  return text.find(line) != std::string::npos;
}

TEST(NamesByIdentity, EachGetsWhatIsBelowItsName) {
  NamedRobots s;
  s.graph({topic("/robot1/cmd").pub(1), topic("/robot2/other").pub(2), topic("/cmd").pub(3)});
  EXPECT_EQ(s.said(1), "offer 1/cmd[1]\n");
  EXPECT_EQ(s.said(2), "offer 1/other[1]\n");
}

TEST(NamesByIdentity, EqualTopicsAreDifferentMirrors) {
  NamedRobots s;
  s.graph({topic("/robot1/scan").sub(5), topic("/robot2/scan").sub(6)});
  s.said(1);
  s.said(2);
  s.say(1, Offer{{channel(1, "/scan", {origin(1, 11)})}, true});
  s.say(2, Offer{{channel(1, "/scan", {origin(1, 12)})}, true});
  s.pass(1500);
  const std::string did = s.did();
  EXPECT_TRUE(tells_line(did, "mirror 2 /robot1/scan")) << did;
  EXPECT_TRUE(tells_line(did, "mirror 3 /robot2/scan")) << did;
  EXPECT_TRUE(tells_line(s.said(1), "demand 1 on"));
  EXPECT_TRUE(tells_line(s.said(2), "demand 1 on"));
  s.message(1, 1, 1, "one");
  s.message(2, 1, 1, "two");
  EXPECT_EQ(s.did(), "publish 2 one\npublish 3 two\n");
}

TEST(NamesByIdentity, EqualServicesAreDifferentMirrors) {
  NamedRobots s;
  s.offer_from_both(service_channel(1, "/flip"));
  for (const std::uint32_t n : {1U, 2U}) s.say(n, Attached{{1}, {1}, {}, {}, ""});
  s.pass(2000);
  const std::string did = s.did();
  EXPECT_TRUE(tells_line(did, "mirror_service 1 /robot1/flip")) << did;
  EXPECT_TRUE(tells_line(did, "mirror_service 2 /robot2/flip")) << did;
}

TEST(NamesByIdentity, AListenerIsHeardBelowItsName) {
  NamedRobots s;
  Listeners told;
  told.added.push_back({{1}, "/cmd_vel", "std_msgs/msg/String", ""});
  s.say(2, told);
  const std::string did = s.did();
  EXPECT_TRUE(tells_line(did, " /robot2/cmd_vel ")) << did;
  EXPECT_FALSE(tells_line(did, "/robot1")) << did;
}

TEST(NamesByIdentity, ARemapIsForAll) {
  NamedRobots s;
  s.graph({topic("/tf").pub(1)});
  EXPECT_EQ(s.said(1), "offer 1/tf[1]\n");
  EXPECT_EQ(s.said(2), "offer 1/tf[1]\n");
}

TEST(NamesByIdentity, WhoHasNoNameForRosIsRefused) {
  NamedRobots s;
  EXPECT_TRUE(tells_line(s.log_in_as(3, "robot-7"), "close 3 4003"));
  EXPECT_TRUE(tells_line(s.logged, "identity_names: [\"robot-7:=robot_7\"]")) << s.logged;
}

TEST(NamesByIdentity, ANameOfTheTableIsNobodyElses) {
  NamedRobots s;
  EXPECT_FALSE(tells_line(s.log_in_as(3, "robot-9"), "close"));
  EXPECT_TRUE(tells_line(s.log_in_as(4, "nine"), "close 4 4003"));
  EXPECT_TRUE(tells_line(s.logged, "given the name \"nine\" to \"robot-9\"")) << s.logged;
}

}  // namespace
}  // namespace connect_bridge::side_test
