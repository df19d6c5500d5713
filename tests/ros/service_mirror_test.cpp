#include <cstdio>
#include <fstream>
#include <set>

#include "ros/gateway.hpp"
#include "ros/rcl/distro.hpp"
#include "ros/rcl/middleware.hpp"
#include "ros/service_fixture.hpp"

namespace connect_bridge::ros {
namespace {

class ServiceMirrorTest : public RosTest {
 protected:
  void mirror(TestSide& side, const std::string& type = kSetBool, const std::string& hash = "") {
    side.gateway.apply(CreateServiceMirror{kMirror, topic("service"), type, hash});
  }
  void respond(TestSide& side, RequestId request, const Bytes& bytes) {
    side.gateway.apply(SendResponse{kMirror, request, Payload::copy_of(bytes)});
  }
  // The response to the next one.
  std::optional<RawClient::Response> answer(TestSide& side, RawClient& client) {
    std::optional<RawClient::Response> found;
    side.until([&] { return (found = client.take()).has_value(); });
    return found;
  }

  static constexpr ServiceMirrorId kMirror{5};
};

TEST_F(ServiceMirrorTest, CarriesACall) {
  TestNode caller("caller");
  TestSide side("connect_client");
  RawClient client(caller, topic("service"));
  EXPECT_FALSE(client.ready());
  mirror(side);
  ASSERT_TRUE(side.until([&] { return client.ready(); }));
  side.drain_for(200ms);  // so that the server knows the client, too
  const std::int64_t number = client.send(set_bool(true));
  const auto request = side.next<RequestTaken>();
  ASSERT_TRUE(request);
  EXPECT_EQ(kMirror, request->mirror);
  EXPECT_NE(0u, request->request.value);
  EXPECT_EQ(1, bytes_of(request->payload)[4]);
  EXPECT_EQ(1u, side.gateway.counters().pending_calls);
  respond(side, request->request, set_bool_answer(true, "it is on"));
  const auto response = answer(side, client);
  ASSERT_TRUE(response);
  EXPECT_EQ(number, response->first);
  EXPECT_EQ(set_bool_answer(true, "it is on"), response->second);
  EXPECT_EQ(0u, side.gateway.counters().pending_calls);
  // The request has been answered: a second answer goes nowhere.
  respond(side, request->request, set_bool_answer(true, "twice"));
  side.drain_for(100ms);
  EXPECT_FALSE(client.take());
}

TEST_F(ServiceMirrorTest, VanishesWhenItIsDestroyed) {
  TestNode caller("caller");
  TestSide side("connect_client");
  RawClient client(caller, topic("service"));
  mirror(side);
  ASSERT_TRUE(side.until([&] { return client.ready(); }));
  client.send(set_bool(true));
  const auto request = side.next<RequestTaken>();
  ASSERT_TRUE(request);
  side.gateway.apply(DestroyServiceMirror{kMirror});
  EXPECT_TRUE(side.until([&] { return !client.ready(); }));
  EXPECT_EQ(0u, side.gateway.counters().pending_calls);
  respond(side, request->request, set_bool_answer(true, "late"));
  mirror(side);
  EXPECT_TRUE(side.until([&] { return client.ready(); }));
}

// One that has said that a goal was aborted stays for a farewell, whose end wakes the loop.
TEST_F(ServiceMirrorTest, VanishesAfterItsFarewell) {
  TestNode caller("caller");
  TestSide side("connect_client");
  RawClient client(caller, topic("service"));
  mirror(side);
  ASSERT_TRUE(side.until([&] { return client.ready(); }));
  client.send(set_bool(true));
  const auto request = side.next<RequestTaken>();
  ASSERT_TRUE(request);
  side.drain_for(3s);  // nothing else wakes it any longer
  side.gateway.apply(DropRequest{kMirror, request->request, true});
  side.drain_for(500ms);
  side.gateway.apply(DestroyServiceMirror{kMirror});
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (client.ready() && side.alarm.wait(end))
    while (side.gateway.drain([](Input&&) {})) {
    }
  EXPECT_FALSE(client.ready());
}

TEST_F(ServiceMirrorTest, LosesNoRequestOfABurst) {
  TestNode caller("caller");
  TestSide side("connect_client");
  // The caller's own queue is as deep, otherwise it would lose some itself.
  rmw_qos_profile_t qos = rmw_qos_profile_services_default;
  qos.depth = 1000;
  RawClient client(caller, topic("service"), kSetBool, qos);
  mirror(side);
  ASSERT_TRUE(side.until([&] { return client.ready(); }));
  // Nobody takes anything until all of them are on their way.
  std::set<std::int64_t> open;
  for (int i = 0; i < 1000; ++i) open.insert(client.send(set_bool(i % 2 == 0)));
  std::vector<RequestTaken> requests;
  ASSERT_TRUE(side.until([&] {
    while (auto request = side.next<RequestTaken>(0ms)) requests.push_back(*request);
    return requests.size() == 1000;
  })) << requests.size();
  for (std::size_t i = 0; i < requests.size(); ++i) {
    EXPECT_EQ(i % 2 == 0 ? 1 : 0, bytes_of(requests[i].payload)[4]) << "order";
    respond(side, requests[i].request, set_bool_answer(true, std::to_string(i)));
  }
  EXPECT_TRUE(side.until([&] {
    while (const auto response = client.take()) open.erase(response->first);
    return open.empty();
  })) << open.size();
}

TEST_F(ServiceMirrorTest, AnswersEachCallerWithItsOwn) {
  TestNode first("first"), second("second");
  TestSide side("connect_client");
  rmw_qos_profile_t qos = rmw_qos_profile_services_default;
  qos.depth = 32;
  RawClient clients[] = {RawClient(first, topic("service"), kSetBool, qos),
                         RawClient(second, topic("service"), kSetBool, qos)};
  mirror(side);
  ASSERT_TRUE(side.until([&] { return clients[0].ready() && clients[1].ready(); }));
  for (int i = 0; i < 32; ++i) {
    for (auto& client : clients) client.send(set_bool(&client == &clients[1]));
  }
  std::vector<RequestTaken> requests;
  ASSERT_TRUE(side.until([&] {
    while (auto request = side.next<RequestTaken>(0ms)) requests.push_back(*request);
    return requests.size() == 64;
  }));
  std::set<std::int64_t> answered[2];
  // Last in, first out.
  while (!requests.empty()) {
    for (int i = 0; i < 8; ++i) {
      const bool second_one = bytes_of(requests.back().payload)[4] == 1;
      respond(side, requests.back().request,
              set_bool_answer(second_one, second_one ? "second" : "first"));
      requests.pop_back();
    }
    const std::size_t wanted = 64 - requests.size();
    ASSERT_TRUE(side.until([&] {
      for (int i = 0; i < 2; ++i) {
        while (const auto response = clients[i].take()) {
          EXPECT_EQ(i == 0 ? set_bool_answer(false, "first") : set_bool_answer(true, "second"),
                    response->second);
          answered[i].insert(response->first);
        }
      }
      return answered[0].size() + answered[1].size() == wanted;
    })) << wanted;
  }
}

TEST_F(ServiceMirrorTest, RefusesTypes) {
  GatewayOptions options;
  options.types_not_installed = false;
  TestSide side("connect_client", options);
  for (const char* type : {"no_such_package/srv/Thing", "std_srvs/srv/NoSuchService",
                           "std_srvs/msg/SetBool", "../../evil/srv/SetBool", "SetBool", ""}) {
    mirror(side, type);
    const auto failed = side.next<ServiceMirrorFailed>();
    ASSERT_TRUE(failed) << type;
    EXPECT_EQ(kMirror, failed->id);
    EXPECT_EQ("type_unknown", failed->code);
    EXPECT_NE("", failed->reason);
  }
#if CONNECT_TYPE_HASHES
  mirror(side, kSetBool, "RIHS01_" + std::string(64, '0'));
  const auto failed = side.next<ServiceMirrorFailed>();
  ASSERT_TRUE(failed);
  EXPECT_EQ("type_mismatch", failed->code);
#endif
  side.gateway.apply(CreateServiceMirror{kMirror, "/not a name", kSetBool, ""});
  const auto nameless = side.next<ServiceMirrorFailed>();
  ASSERT_TRUE(nameless);
  EXPECT_EQ("failed", nameless->code);
  EXPECT_EQ(0u, side.gateway.counters().service_mirrors);
}

// An answer that does not have the type is dropped, and the next one is sent.
TEST_F(ServiceMirrorTest, DropsAnswersThatAreNone) {
  TestNode caller("caller");
  TestSide side("connect_client");
  RawClient client(caller, topic("service"));
  mirror(side);
  ASSERT_TRUE(side.until([&] { return client.ready(); }));
  const Bytes bad[] = {{}, {0, 1, 0, 0}, Cdr{}.u8(1).u32(0xffffffff).bytes(), {0, 3, 0, 0, 1}};
  for (const Bytes& bytes : bad) {
    client.send(set_bool(true));
    const auto request = side.next<RequestTaken>();
    ASSERT_TRUE(request);
    respond(side, request->request, bytes);
  }
  EXPECT_EQ(std::size(bad), side.gateway.counters().refused_calls);
  EXPECT_EQ(0u, side.gateway.counters().pending_calls);
  const std::int64_t number = client.send(set_bool(true));
  const auto request = side.next<RequestTaken>();
  ASSERT_TRUE(request);
  respond(side, request->request, set_bool_answer(true, "fine"));
  const auto response = answer(side, client);
  ASSERT_TRUE(response);
  EXPECT_EQ(number, response->first);
}

TEST_F(ServiceMirrorTest, DropsRequestsThatAreTooLarge) {
  TestNode caller("caller");
  GatewayOptions options;
  options.message_bytes_max = 1000;
  TestSide side("connect_client", options);
  const std::string type = std::string{kTestPackage} + "/srv/Upload";
  RawClient client(caller, topic("service"), type);
  mirror(side, type);
  ASSERT_TRUE(side.until([&] { return client.ready(); }));
  client.send(Cdr{}.u32(2000).zeros(2000).bytes());
  client.send(Cdr{}.u32(20).zeros(20).bytes());
  const auto request = side.next<RequestTaken>();
  ASSERT_TRUE(request);
  EXPECT_EQ(28u, request->payload.size());
  EXPECT_EQ(1u, side.gateway.counters().refused_calls);
  EXPECT_EQ(1u, side.gateway.counters().pending_calls);
}

TEST_F(ServiceMirrorTest, TellsWhichCallersHaveLeft) {
  if (!middleware().tells_callers()) GTEST_SKIP() << "this middleware does not tell callers apart";
  TestNode staying("staying");
  auto leaving = std::make_unique<TestNode>("leaving");
  TestSide side("connect_client");
  RawClient stays(staying, topic("service"));
  auto leaves = std::make_unique<RawClient>(*leaving, topic("service"));
  mirror(side);
  ASSERT_TRUE(side.until([&] { return stays.ready() && leaves->ready(); }));
  stays.send(set_bool(false));
  leaves->send(set_bool(true));
  leaves->send(set_bool(true));
  std::vector<RequestId> left;
  std::optional<RequestId> stayed;
  ASSERT_TRUE(side.until([&] {
    while (auto request = side.next<RequestTaken>(0ms)) {
      if (bytes_of(request->payload)[4] == 1) {
        left.push_back(request->request);
      } else {
        stayed = request->request;
      }
    }
    return stayed && left.size() == 2;
  }));
  side.drain_for(300ms);
  EXPECT_FALSE(side.next<CallersGone>(0ms));
  leaves.reset();
  const auto begin = std::chrono::steady_clock::now();
  const auto gone = side.next<CallersGone>();
  ASSERT_TRUE(gone);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 500ms);
  EXPECT_EQ(kMirror, gone->mirror);
  EXPECT_EQ(left, gone->requests);
  EXPECT_EQ(1u, side.gateway.counters().pending_calls);
  respond(side, *stayed, set_bool_answer(true, "you waited"));
  EXPECT_TRUE(answer(side, stays));
}

// The caller leaves before anybody looked for it in the graph.
TEST_F(ServiceMirrorTest, NoticesCallersThatWereNeverSeen) {
  TestNode caller("caller");
  GatewayOptions options;
  options.steps_per_wake_max = 1;  // so that a request can be taken without a look at the graph
  TestSide side("connect_client", options);
  mirror(side);
  auto client = std::make_unique<RawClient>(caller, topic("service"));
  ASSERT_TRUE(side.until([&] { return client->ready(); }));
  side.drain_for(200ms);
  client->send(set_bool(true));
  std::optional<RequestId> taken;
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (!taken && std::chrono::steady_clock::now() < deadline) {
    side.alarm.wait(deadline);
    side.gateway.drain([&](Input&& input) {
      if (auto* request = std::get_if<RequestTaken>(&input)) taken = request->request;
    });
  }
  ASSERT_TRUE(taken);
  client.reset();
  const auto gone = side.next<CallersGone>();
  ASSERT_TRUE(gone);
  EXPECT_EQ(std::vector{*taken}, gone->requests);
}

std::size_t resident_megabytes() {
  std::size_t total = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> total >> resident;
  return resident * 4096 >> 20;
}

// The middleware keeps as many answers as its queue is deep: not for longer than they are needed.
TEST_F(ServiceMirrorTest, LargeAnswersAreNotKept) {
  TestNode caller("caller");
  TestSide side("connect_client");
  const std::string type = std::string{kTestPackage} + "/srv/Download";
  RawClient client(caller, topic("service"), type);
  mirror(side, type);
  ASSERT_TRUE(side.until([&] { return client.ready(); }));
  const Bytes large = Cdr{}.u32(4U << 20).zeros(4U << 20).bytes();
  std::size_t before = 0;
  for (int i = 0; i < 120; ++i) {
    client.send(Cdr{}.u64(1).u32(0).bytes());
    const auto request = side.next<RequestTaken>();
    ASSERT_TRUE(request);
    respond(side, request->request, large);
    ASSERT_TRUE(answer(side, client)) << i;
    if (i == 20) before = resident_megabytes();
  }
  const std::size_t after = resident_megabytes();
  std::printf("[          ] resident after 20 answers of 4 MB: %zu MB, after 120: %zu MB\n", before,
              after);
  EXPECT_LT(after, before + 60);
}

// Its requests arrive, but it wants responses of a kind that we do not offer: the middleware waits
// 100 ms for each one, which must not add up.
TEST_F(ServiceMirrorTest, ACallerThatCannotBeReachedDoesNotHoldTheLoop) {
  TestNode caller("caller");
  TestSide side("connect_client");
  rmw_qos_profile_t qos = rmw_qos_profile_services_default;
  qos.durability = RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL;
  RawClient client(caller, topic("service"), kSetBool, qos);
  RawClient good(caller, topic("service"));
  mirror(side);
  ASSERT_TRUE(side.until([&] { return good.ready(); }));
  std::vector<RequestTaken> requests;
  ASSERT_TRUE(side.until([&] {
    client.send(set_bool(true));
    while (auto request = side.next<RequestTaken>(0ms)) requests.push_back(*request);
    return requests.size() >= 20;
  }));
  const auto begin = std::chrono::steady_clock::now();
  for (const auto& request : requests) {
    respond(side, request.request, set_bool_answer(true, "nobody hears"));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 500ms);
  good.send(set_bool(false));
  std::optional<RequestTaken> request;
  do {
    request = side.next<RequestTaken>();
    ASSERT_TRUE(request);
  } while (bytes_of(request->payload)[4] == 1);  // one more of the other
  respond(side, request->request, set_bool_answer(true, "you do"));
  EXPECT_TRUE(answer(side, good));
}

// A caller can repeat them without end, so the log has one line in ten seconds.
TEST_F(ServiceMirrorTest, RequestsThatAreNoneAreDroppedAndRarelyLogged) {
  constexpr std::uint64_t kCount = 20;
  TestNode caller("caller");
  TestSide side("connect_client");
  const std::string type = std::string{kTestPackage} + "/srv/Reflect";
  RawClient client(caller, topic("service"), type);
  mirror(side, type);
  ASSERT_TRUE(side.until([&] { return client.ready(); }));
  testing::internal::CaptureStderr();
  for (std::uint64_t i = 1; i <= kCount; ++i) {
    client.send_with(overfill);
    EXPECT_TRUE(side.until([&] { return side.gateway.counters().refused_calls == i; })) << i;
  }
  const std::string log = testing::internal::GetCapturedStderr();
  std::size_t lines = 0;
  for (auto at = log.find("is lost"); at != std::string::npos; at = log.find("is lost", at + 1)) {
    ++lines;
  }
  EXPECT_EQ(1u, lines) << log;
  EXPECT_FALSE(side.next<RequestTaken>(0ms));
  EXPECT_EQ(0u, side.gateway.counters().pending_calls);
}

}  // namespace
}  // namespace connect_bridge::ros
