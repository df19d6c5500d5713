// Types whose packages are not installed: their messages pass as bytes.
#include "ros/types/bare_types.hpp"

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/config.h>
#include <rmw/rmw.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <numeric>
#include <tuple>

#include "ros/gateway.hpp"
#include "ros/rcl/middleware.hpp"
#include "ros/ros_fixture.hpp"
#include "ros/service_fixture.hpp"
#include "ros/types/bare_form.hpp"
#include "ros/types/type_supports.hpp"

namespace connect_bridge::ros {
namespace {

const std::string kHash = "RIHS01_" + std::string(64, 'a');
const std::string kOther = "RIHS01_" + std::string(64, 'b');

Bytes message_of(std::size_t size) {
  Bytes bytes(4 + size);
  bytes[1] = 1;
  std::iota(bytes.begin() + 4, bytes.end(), std::uint8_t{0});
  return bytes;
}

// Middlewares pad to four bytes, and the header says by how many.
bool same(const Bytes& bytes, const Payload& payload) {
  const ByteView got = payload.view();
  return got.size() >= bytes.size() && got.size() < bytes.size() + 4 &&
         std::equal(bytes.begin(), bytes.begin() + 2, got.begin()) &&
         std::equal(bytes.begin() + 4, bytes.end(), got.begin() + 4);
}

// As a middleware does that has received these bytes.
bool read(MessageForm& form, Bytes& bytes) {
  namespace fast = eprosima::fastcdr;
  fast::FastBuffer buffer(reinterpret_cast<char*>(bytes.data()), bytes.size());
#if FASTCDR_VERSION_MAJOR >= 2
  fast::Cdr cdr(buffer, fast::Cdr::DEFAULT_ENDIAN);
#else
  fast::Cdr cdr(buffer, fast::Cdr::DEFAULT_ENDIAN, fast::Cdr::DDS_CDR);
#endif
  cdr.read_encapsulation();
  return bare_callbacks().cdr_deserialize(cdr, form.message());
}

struct Serialized {
  Serialized() {
    auto allocator = rcutils_get_default_allocator();
    EXPECT_EQ(RMW_RET_OK, rmw_serialized_message_init(&message, 0, &allocator));
  }
  ~Serialized() { EXPECT_EQ(RMW_RET_OK, rmw_serialized_message_fini(&message)); }
  Serialized(const Serialized&) = delete;
  Serialized& operator=(const Serialized&) = delete;
  [[nodiscard]] Bytes bytes() const {
    return {message.buffer, message.buffer + message.buffer_length};
  }

  rmw_serialized_message_t message = rmw_get_zero_initialized_serialized_message();
};

class BareTypesTest : public RosTest {
 protected:
  void SetUp() override {
    if (!middleware().takes_bare_types) GTEST_SKIP() << "not with this middleware";
  }

  static bool has_no_services() { return !middleware().takes_bare_services; }
  // The graph does not tell the hash that a client needs there.
  static bool has_no_clients() { return has_no_services() || middleware().joins_by_hash; }

  using TypeOf = std::function<std::string(std::uint32_t)>;

  // Milliseconds for a mirror, and kB.
  static std::pair<double, double> cost_of_mirrors(TestSide& side, std::uint32_t& id,
                                                   const TypeOf& type,
                                                   const std::string& hash = "");
  // Microseconds for a call from bytes to bytes, through the middleware of one machine.
  static double cost_of_calls(const std::string& type, const Bytes& request, const Bytes& response);
};

TEST(BareForm, TakesAllBytesWhateverTheirNumber) {
  const auto form = bare_form(kMadeUp);
  std::vector<std::size_t> sizes(300);
  std::iota(sizes.begin(), sizes.end(), 0);
  for (const std::size_t large : {70'000, 3, 1'000'003, 65'536, 65'537, 131'072, 0, 5'000'000, 1})
    sizes.push_back(large);
  for (int twice = 0; twice < 2; ++twice) {
    for (const std::size_t size : sizes) {
      Bytes bytes = message_of(size);
      ASSERT_TRUE(read(*form, bytes)) << size;
      Serialized taken;
      EXPECT_EQ(std::nullopt, form->write_to(taken.message));
      EXPECT_TRUE(bytes == taken.bytes()) << size;
      // It may wait in a queue that counts its size.
      EXPECT_LE(taken.message.buffer_capacity, 2 * (4 + size) + 64) << size;
      form->reset();
    }
  }
}

TEST(BareForm, KeepsTheByteOrderThatItFound) {
  const auto form = bare_form(kMadeUp);
  Bytes bytes = message_of(8);
  bytes[1] = 0;
  ASSERT_TRUE(read(*form, bytes));
  Serialized taken;
  EXPECT_EQ(std::nullopt, form->write_to(taken.message));
  EXPECT_TRUE(bytes == taken.bytes());
}

TEST(BareForm, SendsOnlyPlainCdrOfThisByteOrder) {
  const auto form = bare_form(kMadeUp);
  Bytes good = message_of(8);
  EXPECT_EQ(std::nullopt, form->read_from(good, 0));
  EXPECT_EQ(8u, bare_callbacks().get_serialized_size(form->message()));
  for (const Bytes& bad : {Bytes{}, Bytes{0, 1, 0}, Bytes{0, 0, 0, 0, 1}, Bytes{0, 7, 0, 0, 1},
                           Bytes{1, 1, 0, 0, 1}}) {
    EXPECT_NE(std::nullopt, form->read_from(bad, 0));
  }
  form->reset();
  EXPECT_EQ(0u, bare_callbacks().get_serialized_size(form->message()));
}

TEST_F(BareTypesTest, AreOfOneNameAndGoWithTheirLastUser) {
  TypeSupports types(true);
  {
    const auto first = std::get<MessageType>(types.message(kMadeUp, kHash));
    const auto same = std::get<MessageType>(types.message(kMadeUp, kHash));
    const auto other = std::get<MessageType>(types.message(kMadeUp, kOther));
    EXPECT_EQ(nullptr, first.introspection);
    EXPECT_EQ(first.handle, same.handle);
    EXPECT_NE(first.handle, other.handle);
    EXPECT_EQ(first.handle->data, other.handle->data);
    EXPECT_EQ(1u, types.made());
#if CONNECT_TYPE_HASHES
    EXPECT_EQ(kHash, distro::type_hash_of(*first.handle));
    EXPECT_EQ(kOther, distro::type_hash_of(*other.handle));
#endif
    const auto service = types.service("made_up/srv/Do", kHash);
    EXPECT_EQ(has_no_services(), std::holds_alternative<Refusal>(service));
    if (has_no_services()) return;
    EXPECT_EQ(kHash, std::get<0>(service)->hash);
    EXPECT_EQ(3u, types.made());
  }
  EXPECT_EQ(0u, types.made());
}

// A peer may name a type that an installed package does not have.
TEST_F(BareTypesTest, ATypeThatDoesNotExistChangesNothingForTheOthersOfItsPackage) {
  TypeSupports types(true);
  const auto made_up = types.message("std_msgs/msg/Nope", kHash);
  if (!std::holds_alternative<Refusal>(made_up)) {
    EXPECT_EQ(1u, types.made());
  }
  EXPECT_NE(nullptr, std::get<MessageType>(types.message("std_msgs/msg/Int8", "")).introspection);
  EXPECT_EQ(std::nullopt, types.lack_of("std_msgs/msg/Int16", "", false));
  types.message("std_srvs/srv/Nope_Request", kHash);
  const auto kept = types.message("std_srvs/msg/Nope", kHash);
  EXPECT_EQ(std::nullopt, types.lack_of("std_srvs/srv/SetBool", "", true));
  EXPECT_TRUE(std::get<0>(types.service("std_srvs/srv/SetBool", ""))->is_installed);
}

TEST_F(BareTypesTest, OnlyHashesOfRos) {
  TypeSupports types(true);
  const auto code = [&](const std::string& hash) {
    const auto made = types.message(kMadeUp, hash);
    return std::holds_alternative<Refusal>(made) ? std::get<Refusal>(made).code : "";
  };
  const auto keep =
      std::get<MessageType>(types.message(kMadeUp, middleware().joins_by_hash ? kHash : ""));
#if CONNECT_TYPE_HASHES
  for (const char* bad : {"x", "RIHS01_", "RIHS01_00", "RIHS99"})
    EXPECT_EQ("type_mismatch", code(bad)) << bad;
#endif
}

// Any number of them, one after the other or at once, takes no more memory than those in use, and
// keeps nobody from a type.
TEST_F(BareTypesTest, HashesThatNobodyUsesLeaveTheirPlaceToOthers) {
  TypeSupports types(true);
  const auto made = [&](std::size_t i) {
    const std::string digits = std::to_string(1000 + i);
    return std::get<MessageType>(types.message(kMadeUp, "RIHS01_" + std::string(60, '0') + digits));
  };
  const MessageType keep = made(0);
  const auto* place = made(1).handle.get();
  std::vector<MessageType> used;
  for (std::size_t i = 2; i < 200; ++i) {
    used.push_back(made(i));
    EXPECT_NE(keep.handle.get(), used.back().handle.get());
#if CONNECT_TYPE_HASHES
    const auto* hash = used.back().handle->get_type_hash_func(used.back().handle.get());
    EXPECT_EQ(i % 10, hash->value[31] % 16);
#endif
  }
  EXPECT_EQ(place, used.front().handle.get());
}

TEST_F(BareTypesTest, NamesThatAreNoneAreRefused) {
  TypeSupports types(true);
  for (const char* name : {"", "String", "../../evil/msg/String", "std_msgs/msg/Str/ing", "a/b"}) {
    const auto made = types.message(name, kHash);
    ASSERT_TRUE(std::holds_alternative<Refusal>(made)) << name;
    EXPECT_EQ("type_unknown", std::get<Refusal>(made).code);
  }
  // Installed types are not made at run time.
  EXPECT_NE(nullptr, std::get<MessageType>(types.message("std_msgs/msg/String", "")).introspection);
  EXPECT_EQ(0u, types.made());
}

// Half of an action is none: where its services cannot be made, its topics are not.
TEST_F(BareTypesTest, AnActionIsMadeAsAWhole) {
  TypeSupports types(true);
  const auto feedback = types.message("made_up/action/Fly_FeedbackMessage", kHash);
  const auto goal = types.service("made_up/action/Fly_SendGoal", kHash);
  EXPECT_EQ(has_no_services(), std::holds_alternative<Refusal>(feedback));
  EXPECT_EQ(has_no_services(), std::holds_alternative<Refusal>(goal));
  if (!has_no_services()) return;
  EXPECT_EQ("type_unknown", std::get<Refusal>(goal).code);
  EXPECT_NE(std::string::npos,
            std::get<Refusal>(goal).reason.find("made_up/action/Fly is not known here: install"));
}

// From a mirror of ours to a subscription of ours, in two graphs' ends.
TEST_F(BareTypesTest, SamplesPass) {
  TestSide from("connect_server"), to("connect_client");
  const MirrorId mirror{1};
  const SubscriptionId subscription{1};
  from.gateway.apply(CreateMirror{mirror, topic("thing"), kMadeUp, kHash, qos_of_depth(10)});
  const auto state =
      to.topic_state(topic("thing"), [](const TopicState& s) { return s.publishers.size() == 1; });
  ASSERT_TRUE(state);
  EXPECT_EQ(kMadeUp, state->type);
#if CONNECT_TYPE_HASHES
  EXPECT_EQ(kHash, state->type_hash);
#endif
  to.gateway.apply(CreateSubscription{subscription, topic("thing"), kMadeUp, state->type_hash,
                                      qos_of_depth(10)});
  for (const std::size_t size : {8, 1, 100'000}) {
    const Bytes sent = message_of(size);
    std::optional<MessageTaken> taken;
    for (int i = 0; i < 100 && !(taken && same(sent, taken->payload)); ++i) {
      from.gateway.apply(Publish{mirror, Payload::copy_of(sent)});
      taken = to.next<MessageTaken>(std::chrono::milliseconds(100));
    }
    ASSERT_TRUE(taken && same(sent, taken->payload)) << size;
  }
  EXPECT_EQ(1u, to.gateway.counters().types_not_installed);
  to.gateway.apply(DestroySubscription{subscription});
  from.gateway.apply(DestroyMirror{mirror});
  EXPECT_TRUE(to.until([&] { return to.gateway.counters().types_not_installed == 0; }));
  EXPECT_TRUE(from.until([&] { return from.gateway.counters().types_not_installed == 0; }));
}

TEST_F(BareTypesTest, CallsPass) {
  if (has_no_clients()) GTEST_SKIP() << "not with this middleware";
  TestSide caller("connect_client"), server("connect_server");
  const ServiceMirrorId mirror{1};
  const ServiceClientId client{1};
  const std::string type = "made_up/action/Fly_SendGoal";
  server.gateway.apply(CreateServiceMirror{mirror, topic("fly"), type, kHash});
  caller.gateway.apply(CreateServiceClient{client, topic("fly"), type});
  const auto ready = caller.next<ServiceReady>();
  ASSERT_TRUE(ready && ready->ready);
  EXPECT_EQ("", ready->type_hash);
  std::uint64_t number = 0;
  for (const std::size_t size : {1, 20, 20, 300'000, 7}) {
    const Bytes request = message_of(size), response = message_of(2 * size);
    caller.gateway.apply(SendRequest{client, InvocationId{++number}, Payload::copy_of(request)});
    const auto asked = server.next<RequestTaken>();
    ASSERT_TRUE(asked) << size;
    EXPECT_TRUE(same(request, asked->payload)) << size;
    server.gateway.apply(SendResponse{mirror, asked->request, Payload::copy_of(response)});
    const auto answered = caller.next<ResponseTaken>();
    ASSERT_TRUE(answered) << size;
    EXPECT_EQ(InvocationId{number}, answered->invocation);
    EXPECT_TRUE(same(response, answered->payload)) << size;
  }
  caller.gateway.apply(
      SendRequest{client, InvocationId{++number}, Payload::adopt(Bytes{0, 7, 0, 0, 1})});
  EXPECT_TRUE(caller.next<InvocationFailed>());
  caller.gateway.apply(DestroyServiceClient{client});
  server.gateway.apply(DestroyServiceMirror{mirror});
  EXPECT_TRUE(caller.until([&] { return caller.gateway.counters().types_not_installed == 0; }));
  EXPECT_TRUE(server.until([&] { return server.gateway.counters().types_not_installed == 0; }));
}

std::pair<double, double> BareTypesTest::cost_of_mirrors(TestSide& side, std::uint32_t& id,
                                                         const TypeOf& type,
                                                         const std::string& hash) {
  constexpr std::uint32_t kCount = 200;
  const std::size_t memory = resident_kilobytes();
  const auto begin = std::chrono::steady_clock::now();
  for (std::uint32_t i = 0; i < kCount; ++i) {
    ++id;
    side.gateway.apply(CreateMirror{MirrorId{id}, topic("t" + std::to_string(id)), type(id), hash,
                                    qos_of_depth(1)});
  }
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - begin;
  return {took.count() / kCount, (double(resident_kilobytes()) - double(memory)) / kCount};
}

TEST_F(BareTypesTest, AMirrorCostsWhatOneOfAnInstalledTypeDoes) {
  TestSide side("connect_client");
  std::uint32_t id = 0;
  const auto installed = [](std::uint32_t) { return "std_msgs/msg/String"; };
  cost_of_mirrors(side, id, installed);  // the first ones make what all share
  const auto with = cost_of_mirrors(side, id, installed);
  const auto bare = cost_of_mirrors(
      side, id, [](std::uint32_t n) { return "made_up/msg/Thing" + std::to_string(n); }, kHash);
  std::printf(
      "[          ] a mirror: %.3f ms, %.1f kB; of a type of its own that is not installed: "
      "%.3f ms, %.1f kB\n",
      with.first, with.second, bare.first, bare.second);
  EXPECT_EQ(200u, side.gateway.counters().types_not_installed);
  EXPECT_LT(bare.first, 2 * with.first + 20);
}

double BareTypesTest::cost_of_calls(const std::string& type, const Bytes& request,
                                    const Bytes& response) {
  constexpr int kCount = 300;
  TestSide caller("connect_client"), server("connect_server");
  const std::string name = topic("s" + std::to_string(request.size()));
  server.gateway.apply(CreateServiceMirror{ServiceMirrorId{1}, name, type, ""});
  caller.gateway.apply(CreateServiceClient{ServiceClientId{1}, name, type});
  if (!caller.next<ServiceReady>()) return 0;
  std::chrono::duration<double, std::micro> took{};
  for (std::uint64_t call = 1; call <= kCount; ++call) {
    const auto begin = std::chrono::steady_clock::now();
    caller.gateway.apply(
        SendRequest{ServiceClientId{1}, InvocationId{call}, Payload::copy_of(request)});
    const auto asked = server.next<RequestTaken>();
    if (!asked) return 0;
    server.gateway.apply(
        SendResponse{ServiceMirrorId{1}, asked->request, Payload::copy_of(response)});
    if (!caller.next<ResponseTaken>()) return 0;
    took += std::chrono::steady_clock::now() - begin;
  }
  return took.count() / kCount;
}

TEST_F(BareTypesTest, ACallCostsWhatOneOfAnInstalledTypeDoes) {
  if (has_no_clients()) GTEST_SKIP() << "not with this middleware";
  const Bytes large = Cdr{}.u32(1U << 20).zeros(1U << 20).bytes();
  const Bytes sums = Cdr{}.u64(1).u64(2).bytes();
  const std::string upload = std::string{kTestPackage} + "/srv/Upload";
  for (const auto& [type, request, response] :
       {std::tuple{std::string{kSetBool}, set_bool(true), set_bool_answer(true, "yes")},
        std::tuple{upload, large, sums}}) {
    const double installed = cost_of_calls(type, request, response);
    const double bare = cost_of_calls("made_up/srv/Do", request, response);
    std::printf("[          ] a call with %zu bytes: %.0f us; of a type not installed: %.0f us\n",
                request.size(), installed, bare);
    ASSERT_GT(installed, 0);
    ASSERT_GT(bare, 0);
    EXPECT_LT(bare, 3 * installed + 5000);
  }
}

}  // namespace
}  // namespace connect_bridge::ros
