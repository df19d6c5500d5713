#include "ros/ros_fixture.hpp"

#include <rmw/rmw.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "ros/rcl/distro.hpp"
#include "ros/rcl/publisher_ids.hpp"
#include "ros/rcl/qos.hpp"

namespace connect_bridge::ros {
namespace {

int test_number() {
  static int number = 0;
  static const testing::TestInfo* current = nullptr;
  const auto* info = testing::UnitTest::GetInstance()->current_test_info();
  if (info != current) ++number;
  current = info;
  return number;
}

// Owns an argv while a node reads it.
struct Arguments {
  std::vector<std::string> texts;
  std::vector<const char*> pointers;
  Arguments(const std::string& program, std::vector<std::string> rest) : texts(std::move(rest)) {
    texts.insert(texts.begin(), program);
    for (const auto& text : texts) pointers.push_back(text.c_str());
  }
};

const rosidl_message_type_support_t* type_of_name(const std::string& name) {
  TypeSupports types;
  return std::get<0>(types.message(name, "")).handle.get();
}

// Nodes of one process reach each other through the transports, as nodes of two processes do.
void separate_nodes() {
  static const std::string file =
      testing::TempDir() + "connect_" + std::to_string(getpid()) + ".xml";
  std::ofstream(file) << R"(<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns="http://www.eprosima.com"><library_settings>
<intraprocess_delivery>OFF</intraprocess_delivery></library_settings></dds>)";
  // The name of the variable changed with Fast DDS 3 (Kilted).
  setenv(std::getenv("ROS_DISTRO") == std::string{"jazzy"} ? "FASTRTPS_DEFAULT_PROFILES_FILE"
                                                           : "FASTDDS_DEFAULT_PROFILES_FILE",
         file.c_str(), 1);
  std::atexit([] { unlink(file.c_str()); });
}

}  // namespace

Bytes bytes_of(const Payload& payload) {
  return {payload.view().begin(), payload.view().end()};
}

std::size_t threads() {
  std::size_t count = 0;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string name;
    if (!std::getline(std::ifstream(task.path() / "comm"), name)) continue;  // it has ended
    // Zenoh starts and ends the threads of its pools ("rx-5") as it needs them.
    constexpr std::array<std::string_view, 5> kPools{"acc-", "app-", "net-", "rx-", "tx-"};
    if (std::none_of(kPools.begin(), kPools.end(),
                     [&](std::string_view pool) { return name.starts_with(pool); }))
      ++count;
  }
  return count;
}

std::size_t resident_kilobytes() {
  std::size_t total = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> total >> resident;
  return resident * 4;
}

bool may_block_when_destroying() {
  return rmw_get_implementation_identifier() == std::string_view{"rmw_zenoh_cpp"};
}

RosTest::RosTest() {
  static const bool separated = (separate_nodes(), true);
  EXPECT_TRUE(separated);
  setenv("ROS_DOMAIN_ID", std::to_string(domain_.id()).c_str(), 1);
  setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST", 1);
}

std::string RosTest::topic(const std::string& name) {
  return "/" + name + "_" + std::to_string(getpid()) + "_" + std::to_string(test_number());
}

void Alarm::wake() {
  {
    const std::lock_guard lock(mutex_);
    woken_ = true;
  }
  changed_.notify_all();
}

bool Alarm::wait(std::chrono::steady_clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  const bool woken = changed_.wait_until(lock, deadline, [this] { return woken_; });
  woken_ = false;
  return woken;
}

TestNode::TestNode(const std::string& name, std::vector<std::string> arguments) {
  const Arguments given(name, std::move(arguments));
  NodeOptions options;
  options.name = name;
  options.argc = static_cast<int>(given.pointers.size());
  options.argv = given.pointers.data();
  node_ = std::make_unique<Node>(options);
}

TestSide::TestSide(const std::string& name, GatewayOptions options,
                   std::vector<std::string> arguments)
    : node(name, std::move(arguments)), gateway(*node, options, [this] { alarm.wake(); }) {}

bool TestSide::until(const std::function<bool()>& done, std::chrono::milliseconds patience) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (!done()) {
    const auto now = std::chrono::steady_clock::now();
    if (now > deadline) return false;
    // `done` may look at more than inputs, so it is asked from time to time.
    alarm.wait(std::min(deadline, now + 20ms));
    while (gateway.drain([this](Input&& input) {
      if (auto* changed = std::get_if<GraphChanged>(&input)) {
        graph = *changed;
        ++graphs;
      }
      inputs.push_back(std::move(input));
    })) {
    }
  }
  return true;
}

void TestSide::drain_for(std::chrono::milliseconds duration) {
  until([] { return false; }, duration);
}

std::optional<TopicState> TestSide::find_topic(const std::string& name) const {
  for (const TopicState& state : graph.topics) {
    if (state.name == name) return state;
  }
  return std::nullopt;
}

RawPublisher::RawPublisher(TestNode& node, const std::string& topic, const Qos& qos,
                           const std::string& type)
    : node_(node) {
  rcl_publisher_options_t options = rcl_publisher_get_default_options();
  options.qos = to_rmw(qos);
  EXPECT_EQ(RCL_RET_OK, rcl_publisher_init(&publisher_, node->handle(), type_of_name(type),
                                           topic.c_str(), &options));
}

RawPublisher::~RawPublisher() {
  EXPECT_EQ(RCL_RET_OK, rcl_publisher_fini(&publisher_, node_->handle()));
}

void RawPublisher::publish(const Bytes& bytes) {
  rcl_serialized_message_t message = rmw_get_zero_initialized_serialized_message();
  message.buffer = const_cast<std::uint8_t*>(bytes.data());
  message.buffer_length = bytes.size();
  message.buffer_capacity = bytes.size();
  EXPECT_EQ(RCL_RET_OK, rcl_publish_serialized_message(&publisher_, &message, nullptr));
}

std::size_t RawPublisher::matched() {
  std::size_t count = 0;
  EXPECT_EQ(RCL_RET_OK, rcl_publisher_get_subscription_count(&publisher_, &count));
  return count;
}

Gid RawPublisher::gid() const {
  rmw_gid_t gid{};
  EXPECT_EQ(RMW_RET_OK, rmw_get_gid_for_publisher(rcl_publisher_get_rmw_handle(&publisher_), &gid));
  return node_->publisher_ids().id_of(distro::gid_of(gid.data));
}

RawSubscription::RawSubscription(TestNode& node, const std::string& topic, const Qos& qos,
                                 const std::string& type)
    : node_(node) {
  rcl_subscription_options_t options = rcl_subscription_get_default_options();
  options.qos = to_rmw(qos);
  EXPECT_EQ(RCL_RET_OK, rcl_subscription_init(&subscription_, node->handle(), type_of_name(type),
                                              topic.c_str(), &options));
}

RawSubscription::~RawSubscription() {
  EXPECT_EQ(RCL_RET_OK, rcl_subscription_fini(&subscription_, node_->handle()));
}

std::optional<Bytes> RawSubscription::take() {
  rcl_serialized_message_t message = rmw_get_zero_initialized_serialized_message();
  auto allocator = rcl_get_default_allocator();
  EXPECT_EQ(RMW_RET_OK, rmw_serialized_message_init(&message, 0, &allocator));
  std::optional<Bytes> bytes;
  if (rcl_take_serialized_message(&subscription_, &message, nullptr, nullptr) == RCL_RET_OK) {
    bytes.emplace(message.buffer, message.buffer + message.buffer_length);
  }
  EXPECT_EQ(RMW_RET_OK, rmw_serialized_message_fini(&message));
  return bytes;
}

Bytes string_message(const std::string& text) {
  const auto size = static_cast<std::uint32_t>(text.size() + 1);
  Bytes bytes{0, 1, 0, 0};
  for (int shift = 0; shift < 32; shift += 8) {
    bytes.push_back(static_cast<std::uint8_t>(size >> shift));
  }
  bytes.insert(bytes.end(), text.begin(), text.end());
  bytes.push_back(0);
  while (bytes.size() % 4 != 0) bytes.push_back(0);
  return bytes;
}

Qos qos_of_depth(std::uint32_t depth) {
  Qos qos;
  qos.depth = depth;
  return qos;
}

}  // namespace connect_bridge::ros
