// Mirrors and clients that come and go while the middleware's threads are busy with them.
#include <atomic>
#include <thread>

#include "ros/gateway.hpp"
#include "ros/service_fixture.hpp"

namespace connect_bridge::ros {
namespace {

// When a mirror's callback was cleared before its service ended, all of ten runs crashed.
constexpr std::uint32_t kMirrorCycles = 1000;
constexpr std::uint32_t kClientCycles = 100;
// Discovery, which every cycle waits for, takes some milliseconds.
constexpr auto kAllCycles = 60s;

class ServiceChurnTest : public RosTest {
 protected:
  // Does something again and again on a thread of its own, while it lives.
  class Busy {
   public:
    Busy(std::chrono::microseconds pause, std::function<void()> work)
        : thread_([this, pause, work = std::move(work)] {
            while (!stop_) {
              work();
              std::this_thread::sleep_for(pause);
            }
          }) {}
    ~Busy() {
      stop_ = true;
      thread_.join();
    }
    Busy(const Busy&) = delete;
    Busy& operator=(const Busy&) = delete;

   private:
    std::atomic<bool> stop_{false};
    std::thread thread_;  // last: it uses the other
  };
};

// The middleware once called what had just been cleared.
TEST_F(ServiceChurnTest, ManyMirrorsWhileRequestsArrive) {
  if (may_block_when_destroying()) GTEST_SKIP() << "ros2/rmw_zenoh#993";
  TestNode caller("caller");
  TestSide side("connect_client");
  std::atomic<std::uint64_t> answers{0};
  const auto call = [&](RawClient& client) {
    client.send(set_bool(true));
    while (client.take()) {
      ++answers;
      side.alarm.wake();
    }
  };
  RawClient first(caller, topic("service")), second(caller, topic("service"));
  Busy first_calls(5us, [&] { call(first); }), second_calls(5us, [&] { call(second); });
  const auto end = std::chrono::steady_clock::now() + kAllCycles;
  for (std::uint32_t cycle = 1; cycle <= kMirrorCycles; ++cycle) {
    const ServiceMirrorId mirror{cycle};
    side.gateway.apply(CreateServiceMirror{mirror, topic("service"), kSetBool, ""});
    const std::uint64_t before = answers;
    const bool answered = side.until([&] {
      for (const Input& input : side.inputs) {
        const auto* request = std::get_if<RequestTaken>(&input);
        if (request == nullptr || request->mirror != mirror) continue;
        side.gateway.apply(SendResponse{mirror, request->request,
                                        Payload::copy_of(set_bool_answer(true, "it is on"))});
      }
      side.inputs.clear();
      return answers > before;
    });
    ASSERT_TRUE(answered) << "cycle " << cycle;
    side.gateway.apply(DestroyServiceMirror{mirror});
    ASSERT_LT(std::chrono::steady_clock::now(), end) << "cycle " << cycle;
  }
  EXPECT_EQ(0u, side.gateway.counters().pending_calls);
}

TEST_F(ServiceChurnTest, ManyClientsWhileResponsesArrive) {
  if (may_block_when_destroying()) GTEST_SKIP() << "ros2/rmw_zenoh#993";
  TestNode robot("robot");
  TestSide side("connect_server");
  RawServer server(robot, topic("service"));
  Busy answers(100us, [&] {
    while (const auto request = server.take()) {
      server.try_respond(*request, set_bool_answer(true, "it is on"));  // it may be gone
    }
  });
  const auto end = std::chrono::steady_clock::now() + kAllCycles;
  for (std::uint32_t cycle = 1; cycle <= kClientCycles; ++cycle) {
    const ServiceClientId client{cycle};
    side.gateway.apply(CreateServiceClient{client, topic("service"), kSetBool});
    const auto ready = side.next<ServiceReady>();
    ASSERT_TRUE(ready && ready->ready && ready->client == client) << "cycle " << cycle;
    for (std::uint32_t call = 1; call <= 8; ++call) {
      side.gateway.apply(SendRequest{client, InvocationId{call}, Payload::copy_of(set_bool(true))});
    }
    // The others arrive while it ends.
    const auto response = side.next<ResponseTaken>();
    ASSERT_TRUE(response && response->client == client) << "cycle " << cycle;
    side.gateway.apply(DestroyServiceClient{client});
    side.inputs.clear();
    ASSERT_LT(std::chrono::steady_clock::now(), end) << "cycle " << cycle;
  }
}

}  // namespace
}  // namespace connect_bridge::ros
