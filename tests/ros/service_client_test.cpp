#include <set>

#include "ros/gateway.hpp"
#include "ros/rcl/distro.hpp"
#include "ros/service_fixture.hpp"

namespace connect_bridge::ros {
namespace {

class ServiceClientTest : public RosTest {
 protected:
  void client(TestSide& side, const std::string& type = kSetBool) {
    side.gateway.apply(CreateServiceClient{kClient, topic("service"), type});
  }
  void send(TestSide& side, std::uint32_t invocation, const Bytes& bytes) {
    side.gateway.apply(SendRequest{kClient, InvocationId{invocation}, Payload::copy_of(bytes)});
  }
  std::optional<RawServer::Request> request(TestSide& side, RawServer& server) {
    std::optional<RawServer::Request> found;
    side.until([&] { return (found = server.take()).has_value(); });
    return found;
  }
  bool ready(TestSide& side, bool wanted) {
    const auto news = side.next<ServiceReady>();
    return news && news->ready == wanted;
  }

  static constexpr ServiceClientId kClient{3};
};

TEST_F(ServiceClientTest, CarriesACall) {
  TestNode robot("robot");
  TestSide side("connect_server");
  RawServer server(robot, topic("service"));
  client(side);
  const auto news = side.next<ServiceReady>();
  ASSERT_TRUE(news);
  EXPECT_EQ(kClient, news->client);
  EXPECT_TRUE(news->ready);
  EXPECT_EQ(CONNECT_TYPE_HASHES ? "RIHS01_" : "", news->type_hash.substr(0, 7));
  send(side, 77, set_bool(true));
  const auto taken = request(side, server);
  ASSERT_TRUE(taken);
  EXPECT_EQ(1, taken->second[4]);
  server.respond(*taken, set_bool_answer(true, "done"));
  const auto response = side.next<ResponseTaken>();
  ASSERT_TRUE(response);
  EXPECT_EQ(kClient, response->client);
  EXPECT_EQ(InvocationId{77}, response->invocation);
  EXPECT_EQ(set_bool_answer(true, "done"), bytes_of(response->payload));
  EXPECT_EQ(0u, side.gateway.counters().pending_calls);
}

// A request is sent as soon as the core knows that the service is ready: none may be lost.
TEST_F(ServiceClientTest, TellsTheTruthAboutServers) {
  TestNode robot("robot");
  TestSide side("connect_server");
  client(side);
  side.drain_for(300ms);
  EXPECT_FALSE(side.next<ServiceReady>(0ms));
  for (std::uint32_t i = 1; i <= 10; ++i) {
    auto server = std::make_unique<RawServer>(robot, topic("service"));
    ASSERT_TRUE(ready(side, true)) << i;
    send(side, i, set_bool(i % 2 == 0));
    const auto taken = request(side, *server);
    ASSERT_TRUE(taken) << i;
    server->respond(*taken, set_bool_answer(true, std::to_string(i)));
    const auto response = side.next<ResponseTaken>();
    ASSERT_TRUE(response);
    EXPECT_EQ(InvocationId{i}, response->invocation);
    const auto begin = std::chrono::steady_clock::now();
    server.reset();
    ASSERT_TRUE(ready(side, false)) << i;
    EXPECT_LT(std::chrono::steady_clock::now() - begin, 500ms);
  }
}

TEST_F(ServiceClientTest, OneOfTwoServersLeavesAndTheServiceStays) {
  TestNode first("first"), second("second");
  TestSide side("connect_server");
  auto one = std::make_unique<RawServer>(first, topic("service"));
  client(side);
  ASSERT_TRUE(ready(side, true));
  auto two = std::make_unique<RawServer>(second, topic("service"));
  const auto servers = [&] {
    for (const ServiceState& state : side.graph.services) {
      if (state.name == topic("service")) return state.servers.size();
    }
    return std::size_t{0};
  };
  ASSERT_TRUE(side.until([&] { return servers() == 2; }));
  side.drain_for(200ms);
  send(side, 1, set_bool(true));
  for (RawServer* server : {one.get(), two.get()}) {
    const auto taken = request(side, *server);
    ASSERT_TRUE(taken);
    server->respond(*taken, set_bool_answer(true, "done"));
  }
  // Both answer; one answer counts.
  EXPECT_TRUE(side.next<ResponseTaken>());
  side.drain_for(200ms);
  EXPECT_FALSE(side.next<ResponseTaken>(0ms));
  one.reset();
  ASSERT_TRUE(side.until([&] { return servers() == 1; }));
  side.drain_for(300ms);
  EXPECT_FALSE(side.next<ServiceReady>(0ms));
  two.reset();
  EXPECT_TRUE(ready(side, false));
}

TEST_F(ServiceClientTest, SixtyFourInFlight) {
  TestNode robot("robot");
  TestSide side("connect_server");
  RawServer server(robot, topic("service"), kSetBool, 100);
  client(side);
  ASSERT_TRUE(ready(side, true));
  for (std::uint32_t i = 1; i <= 64; ++i) send(side, i, set_bool(i % 2 == 0));
  std::vector<RawServer::Request> requests;
  while (requests.size() < 64) {
    const auto taken = request(side, server);
    ASSERT_TRUE(taken) << requests.size();
    requests.push_back(*taken);
  }
  EXPECT_EQ(64u, side.gateway.counters().pending_calls);
  for (auto i = requests.rbegin(); i != requests.rend(); ++i) {
    server.respond(*i, set_bool_answer(i->second[4] == 1, ""));
  }
  std::set<std::uint32_t> answered;
  while (answered.size() < 64) {
    const auto response = side.next<ResponseTaken>();
    ASSERT_TRUE(response) << answered.size();
    EXPECT_EQ(response->invocation.value % 2 == 0 ? 1 : 0, bytes_of(response->payload)[4]);
    answered.insert(response->invocation.value);
  }
}

// Why a service with callers at once needs a bound of its own: a server of the default depth that
// is busy keeps 10 requests, and the middleware silently drops the others.
TEST_F(ServiceClientTest, ABusyServerKeepsTenRequests) {
  TestNode robot("robot");
  TestSide side("connect_server");
  RawServer server(robot, topic("service"));
  client(side);
  ASSERT_TRUE(ready(side, true));
  for (std::uint32_t i = 1; i <= 64; ++i) send(side, i, set_bool(true));
  side.drain_for(300ms);
  int kept = 0;
  while (server.take()) ++kept;
  EXPECT_EQ(10, kept);
}

TEST_F(ServiceClientTest, OfADroppedInvocationOnlyThatItIsAnsweredIsTold) {
  TestNode robot("robot");
  TestSide side("connect_server");
  RawServer server(robot, topic("service"));
  client(side);
  ASSERT_TRUE(ready(side, true));
  for (std::uint32_t i : {1, 2}) {
    send(side, i, set_bool(true));
    const auto taken = request(side, server);
    ASSERT_TRUE(taken);
    if (i == 1) side.gateway.apply(DropInvocation{kClient, InvocationId{1}});
    server.respond(*taken, set_bool_answer(true, std::to_string(i)));
  }
  const auto dropped = side.next<ResponseTaken>();
  ASSERT_TRUE(dropped);
  EXPECT_EQ(InvocationId{1}, dropped->invocation);
  EXPECT_TRUE(dropped->payload.empty());
  const auto response = side.next<ResponseTaken>();
  ASSERT_TRUE(response);
  EXPECT_EQ(InvocationId{2}, response->invocation);
  EXPECT_FALSE(response->payload.empty());
  send(side, 3, set_bool(true));
  side.gateway.apply(DestroyServiceClient{kClient});
  EXPECT_EQ(0u, side.gateway.counters().pending_calls);
}

TEST_F(ServiceClientTest, RefusesRequestsThatAreNone) {
  TestNode robot("robot");
  TestSide side("connect_server");
  const std::string type = std::string{kTestPackage} + "/srv/Upload";
  RawServer server(robot, topic("service"), type);
  client(side, type);
  ASSERT_TRUE(ready(side, true));
  const Bytes bad[] = {{},
                       {0, 1, 0, 0},
                       {0, 1, 0, 0, 1, 0, 0},
                       Cdr{}.u32(5).zeros(4).bytes(),
                       Cdr{}.u32(0xffffffff).zeros(100).bytes(),
                       {0, 7, 0, 0, 0, 0, 0, 0}};
  std::uint32_t invocation = 0;
  for (const Bytes& bytes : bad) {
    send(side, ++invocation, bytes);
    const auto failed = side.next<InvocationFailed>();
    ASSERT_TRUE(failed);
    EXPECT_EQ(InvocationId{invocation}, failed->invocation);
    EXPECT_NE("", failed->reason);
  }
  send(side, 50, Cdr{}.u32(4).zeros(4).bytes());
  EXPECT_TRUE(request(side, server));
  EXPECT_FALSE(server.take());
}

TEST_F(ServiceClientTest, RefusesTypes) {
  GatewayOptions options;
  options.types_not_installed = false;
  TestSide side("connect_server", options);
  for (const char* type : {"no_such_package/srv/Thing", "std_srvs/srv/NoSuchService", ""}) {
    client(side, type);
    const auto failed = side.next<ServiceClientFailed>();
    ASSERT_TRUE(failed) << type;
    EXPECT_EQ("type_unknown", failed->code);
  }
  side.gateway.apply(CreateServiceClient{kClient, "no name", kSetBool});
  const auto failed = side.next<ServiceClientFailed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ("failed", failed->code);
}

TEST_F(ServiceClientTest, AnswersThatAreTooLargeFail) {
  TestNode robot("robot");
  GatewayOptions options;
  options.message_bytes_max = 1000;
  TestSide side("connect_server", options);
  const std::string type = std::string{kTestPackage} + "/srv/Download";
  RawServer server(robot, topic("service"), type);
  client(side, type);
  ASSERT_TRUE(ready(side, true));
  send(side, 1, Cdr{}.u64(2000).u32(0).bytes());
  const auto taken = request(side, server);
  ASSERT_TRUE(taken);
  server.respond(*taken, Cdr{}.u32(2000).zeros(2000).bytes());
  const auto failed = side.next<InvocationFailed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ(InvocationId{1}, failed->invocation);
  EXPECT_NE(std::string::npos, failed->reason.find("more than 1000")) << failed->reason;
}

// A call whose answer is lost must not stay under way for ever.
TEST_F(ServiceClientTest, AnswersThatAreNoneFail) {
  TestNode robot("robot");
  TestSide side("connect_server");
  const std::string type = std::string{kTestPackage} + "/srv/Reflect";
  RawServer server(robot, topic("service"), type);
  client(side, type);
  ASSERT_TRUE(ready(side, true));
  send(side, 7, Cdr{}.zeros(400).bytes());
  const auto taken = request(side, server);
  ASSERT_TRUE(taken);
  server.respond_with(*taken, overfill);
  const auto failed = side.next<InvocationFailed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ(kClient, failed->client);
  EXPECT_EQ(InvocationId{7}, failed->invocation);
  EXPECT_NE(std::string::npos, failed->reason.find("more characters")) << failed->reason;
  EXPECT_EQ(0u, side.gateway.counters().pending_calls);
  EXPECT_EQ(1u, side.gateway.counters().refused_calls);
  EXPECT_FALSE(side.next<ResponseTaken>(0ms));
}

}  // namespace
}  // namespace connect_bridge::ros
