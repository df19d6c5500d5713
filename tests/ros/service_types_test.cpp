// Calls of many types, from a real client through bytes to a real server and back.
#include <cstdio>

#include "ros/gateway.hpp"
#include "ros/service_fixture.hpp"

namespace connect_bridge::ros {
namespace {

struct Call {
  std::string type;
  Bytes request, response;
};

Bytes goal_id() {
  Cdr cdr;
  for (int i = 0; i < 16; ++i) cdr.u8(static_cast<std::uint8_t>(i * 7));
  return cdr.bytes();
}

// connect_bridge_test_interfaces/msg/Everything
Bytes everything() {
  Cdr cdr;
  cdr.u8(1).u8(200).u8('c').u8(0x80).u8(0xff);
  cdr.zeros(1 + 2 + 2);  // int16_value and uint16_value, aligned
  cdr.u32(1).u32(2).u64(3).u64(4).u32(5).u64(6);
  cdr.text(
         "gr\xc3\xbc\xc3\x9f"
         "e")
      .text("sixteen bytes ok");
  cdr.wide(u"\u65e5\u672c\u8a9e \u00fc").wide(u"12345678");
  cdr.u8(0).u8(1).u8(0);
  cdr.u32(3).zeros(6);
  cdr.u32(2).zeros(4);
  cdr.u32(2).u64(7).u64(8);
  cdr.u32(2).text("a").text("");
  cdr.u32(1).text("b");
  cdr.u32(1).text("abcd");
  cdr.u32(2).text("x").text("y");
  cdr.u32(2).wide(u"").wide(u"wide");
  for (int leaf = 0; leaf < 3; ++leaf) {
    if (leaf == 1) cdr.u32(2);  // leaves, behind the single one
    cdr.u8(1).text("leaf").u64(1).u64(2).u64(3).u32(4).u32(5);
  }
  return cdr.bytes();
}

std::vector<Call> calls() {
  const std::string package = kTestPackage;
  const Bytes large = Cdr{}.u32(4U << 20).zeros(4U << 20).bytes();
  return {
      {kSetBool, set_bool(true), set_bool_answer(false, "no")},
      {package + "/srv/Count", Cdr{}.u8(0).bytes(), Cdr{}.u64(42).bytes()},
      {package + "/srv/Download", Cdr{}.u64(4U << 20).u32(0).bytes(), large},
      {package + "/srv/Upload", large, Cdr{}.u64(1).u64(2).bytes()},
      {package + "/srv/Reflect", everything(), everything()},
      {package + "/action/Fibonacci_SendGoal", Cdr{}.zeros(16).u32(5).u32(100).bytes(),
       Cdr{}.u8(1).u32(7).u32(8).bytes()},
      {package + "/action/Fibonacci_GetResult", goal_id(),
       Cdr{}.u8(4).u32(3).u32(0).u32(1).u32(1).bytes()},
      {"action_msgs/srv/CancelGoal", Cdr{}.zeros(16).u32(0).u32(0).bytes(),
       Cdr{}.u8(0).u32(1).zeros(16).u32(1).u32(2).bytes()},
      {"rcl_interfaces/srv/ListParameters", Cdr{}.u32(1).text("a.b").u64(0).bytes(),
       Cdr{}.u32(1).text("a.b.c").u32(0).bytes()},
  };
}

class ServiceTypesTest : public RosTest {};

TEST_F(ServiceTypesTest, CrossUnchanged) {
  TestNode robot("robot"), caller("caller");
  TestSide side("connect_server");
  std::uint32_t number = 0;
  for (const Call& call : calls()) {
    SCOPED_TRACE(call.type);
    ++number;
    const std::string there = topic("there_" + std::to_string(number));
    const std::string here = topic("here_" + std::to_string(number));
    const ServiceClientId to{number};
    const ServiceMirrorId at{number};
    RawServer server(robot, there, call.type);
    RawClient client(caller, here, call.type);
    side.gateway.apply(CreateServiceClient{to, there, call.type});
    const auto news = side.next<ServiceReady>();
    ASSERT_TRUE(news && news->ready);
    side.gateway.apply(CreateServiceMirror{at, here, call.type, news->type_hash});
    ASSERT_TRUE(side.until([&] { return client.ready(); }));

    client.send(call.request);
    const auto request = side.next<RequestTaken>();
    ASSERT_TRUE(request);
    side.gateway.apply(SendRequest{to, InvocationId{1}, request->payload});
    std::optional<RawServer::Request> asked;
    ASSERT_TRUE(side.until([&] { return (asked = server.take()).has_value(); }));
    EXPECT_TRUE(call.request == asked->second);
    server.respond(*asked, call.response);
    const auto response = side.next<ResponseTaken>();
    ASSERT_TRUE(response);
    side.gateway.apply(SendResponse{at, request->request, response->payload});
    std::optional<RawClient::Response> answered;
    ASSERT_TRUE(side.until([&] { return (answered = client.take()).has_value(); }));
    EXPECT_TRUE(call.response == answered->second);
    side.gateway.apply(DestroyServiceMirror{at});
    side.gateway.apply(DestroyServiceClient{to});
  }
}

}  // namespace
}  // namespace connect_bridge::ros
