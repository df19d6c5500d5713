// Shared by the tests of the gateway: a domain per test, a side that waits for inputs, and plain
// rcl endpoints as the rest of the graph.
#pragma once

#include <gtest/gtest.h>
#include <rcl/publisher.h>
#include <rcl/subscription.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/ports/ports.hpp"
#include "ros/domain.hpp"
#include "ros/gateway.hpp"
#include "ros/node/node.hpp"
#include "ros/types/type_supports.hpp"

namespace connect_bridge::ros {

using namespace std::chrono_literals;

constexpr char kString[] = "std_msgs/msg/String";
constexpr auto kPatience = 10s;
constexpr SubscriptionId kSubscription{7};
constexpr MirrorId kMirror{9};

// std_msgs/msg/String in CDR, little endian, padded to 4 bytes as it is on the wire.
Bytes string_message(const std::string& text);
Qos qos_of_depth(std::uint32_t depth);
Bytes bytes_of(const Payload& payload);
std::size_t resident_kilobytes();  // of this process
std::size_t threads();             // of this process
// rmw_zenoh_cpp 0.6.7 blocks its thread for ever when an entity is destroyed while its callback
// runs (ros2/rmw_zenoh#993).
bool may_block_when_destroying();

class RosTest : public testing::Test {
 protected:
  RosTest();
  // "/<name>_<process>_<test>"
  [[nodiscard]] static std::string topic(const std::string& name);

 private:
  Domain domain_;
};

// Lets wait() end when wake() is called on any thread.
class Alarm {
 public:
  void wake();
  bool wait(std::chrono::steady_clock::time_point deadline);

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool woken_ = false;
};

// A node with arguments, as from a command line.
class TestNode {
 public:
  explicit TestNode(const std::string& name, std::vector<std::string> arguments = {});
  Node& operator*() { return *node_; }
  Node* operator->() { return node_.get(); }

 private:
  std::unique_ptr<Node> node_;
};

// A gateway with a loop around it that only runs inside until().
class TestSide {
 public:
  explicit TestSide(const std::string& name, GatewayOptions options = {},
                    std::vector<std::string> arguments = {});

  // Drains until `done` or the deadline, whichever comes first; returns whether it was done.
  bool until(const std::function<bool()>& done, std::chrono::milliseconds patience = kPatience);
  void drain_for(std::chrono::milliseconds duration);

  // The first input of this type since the last call for this type.
  template <class T>
  std::optional<T> next(std::chrono::milliseconds patience = kPatience) {
    std::optional<T> found;
    until([&] { return (found = take_first<T>()).has_value(); }, patience);
    return found;
  }
  // The newest state of a topic; the graph must have been seen to satisfy `good`.
  template <class Good>
  std::optional<TopicState> topic_state(const std::string& name, Good good,
                                        std::chrono::milliseconds patience = kPatience) {
    std::optional<TopicState> found;
    until([&] { return (found = find_topic(name)) && good(*found); }, patience);
    return found && good(*found) ? found : std::nullopt;
  }
  [[nodiscard]] std::optional<TopicState> find_topic(const std::string& name) const;

  TestNode node;
  Alarm alarm;
  Gateway gateway;
  std::deque<Input> inputs;
  GraphChanged graph;  // the newest
  int graphs = 0;

 private:
  template <class T>
  std::optional<T> take_first() {
    for (auto it = inputs.begin(); it != inputs.end(); ++it) {
      if (auto* held = std::get_if<T>(&*it)) {
        T result = std::move(*held);
        inputs.erase(it);
        return result;
      }
    }
    return std::nullopt;
  }
};

// Plain rcl endpoints on a node.
class RawPublisher {
 public:
  RawPublisher(TestNode& node, const std::string& topic, const Qos& qos = qos_of_depth(10),
               const std::string& type = kString);
  ~RawPublisher();
  void publish(const Bytes& bytes);
  std::size_t matched();
  [[nodiscard]] Gid gid() const;

 private:
  TestNode& node_;
  rcl_publisher_t publisher_ = rcl_get_zero_initialized_publisher();
};

class RawSubscription {
 public:
  RawSubscription(TestNode& node, const std::string& topic, const Qos& qos = qos_of_depth(10),
                  const std::string& type = kString);
  ~RawSubscription();
  std::optional<Bytes> take();

 private:
  TestNode& node_;
  rcl_subscription_t subscription_ = rcl_get_zero_initialized_subscription();
};

}  // namespace connect_bridge::ros
