#include "sim/uses.hpp"

#include <algorithm>

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;
using Stream = Thin::Stream;

constexpr TimePoint kFrom{5s};  // from then on ages count

Qos reliable(std::uint32_t depth) {
  Qos qos;
  qos.depth = depth;
  return qos;
}

Qos best_effort(std::uint32_t depth) {
  Qos qos = reliable(depth);
  qos.reliability = Reliability::kBestEffort;
  return qos;
}

Qos latched() {
  Qos qos = reliable(1);
  qos.durability = Durability::kTransientLocal;
  return qos;
}

ThinPlan plan_of(std::uint64_t bytes_per_second, std::vector<ThinFlow> flows) {
  ThinPlan plan;
  plan.path.bytes_per_second = bytes_per_second;
  plan.path.delay = 20ms;
  plan.flows = std::move(flows);
  return plan;
}

ThinPlan with_break(ThinPlan plan, Duration at, Duration how_long) {
  plan.break_at = at;
  plan.break_for = how_long;
  plan.end = at + how_long + 15s;
  return plan;
}

std::string heard_of(const Stream& stream) {
  return std::to_string(stream.heard.size()) + " of " + std::to_string(stream.published);
}

void expect_all(const Stream& stream, const std::string& what) {
  if (stream.heard.size() != stream.published)
    violated(what + ": " + heard_of(stream) + " messages arrived");
}

void expect_last(const Stream& stream, const std::string& what) {
  if (stream.heard.empty() || stream.heard.back().counter != stream.published)
    violated(what + ": the last one did not arrive");
}

void expect_young(const Stream& stream, Duration most, const std::string& what) {
  const Duration age = Thin::age_p99(stream, kFrom);
  if (age > most)
    violated(what + ": " + std::to_string(seconds(age)) + " s old (p99), and no more than " +
             std::to_string(seconds(most)) + " s are right");
}

// ---- the uses

constexpr const char* kGrid = "nav_msgs/msg/OccupancyGrid";

// A grid now and then, and the changes between: one that is missing spoils all that follow.
Use costmap() {
  return {"a costmap with its updates",
          plan_of(60'000, {{"/costmap", kGrid, 40'000, 4s, 0, 1, latched(), 9s},
                           {"/costmap_updates", "map_msgs/msg/OccupancyGridUpdate", 4'000, 100ms, 0,
                            1, reliable(10), 10s}}),
          [](const Thin& thin) {
            expect_last(thin.streams()[0], "the costmap");
            expect_all(thin.streams()[1], "its updates");
            expect_young(thin.streams()[1], 1500ms, "its updates");
          }};
}

Use markers() {
  return {"interactive markers over a break",
          with_break(
              plan_of(100'000, {{"/tool/update", "visualization_msgs/msg/InteractiveMarkerUpdate",
                                 2'000, 200ms, 0, 1, reliable(100), 20s}}),
              6s, 8s),
          [](const Thin& thin) { expect_all(thin.streams()[0], "updates of the markers"); }};
}

// A robot must not execute after the break what was wanted during it.
Use trajectories() {
  constexpr TimePoint kBack{14s};
  return {
      "joint trajectories over a break",
      with_break(
          plan_of(100'000, {{"/arm/joint_trajectory", "trajectory_msgs/msg/JointTrajectory", 3'000,
                             300ms, 1, 1, reliable(1)},
                            {"/setpoint", "my_msgs/msg/Setpoint", 200, 100ms, 1, 1, reliable(1)}}),
          6s, 8s),
      [=](const Thin& thin) {
        for (const Stream& stream : thin.streams()) {
          if (stream.heard.empty() || stream.heard.back().at < kBack + 5s)
            violated("it does not go on after the break");
          for (const auto& heard : stream.heard)
            if (heard.age > 500ms)
              violated("the robot got one that was " + std::to_string(seconds(heard.age)) +
                       " s old");
        }
      }};
}

Use clouds() {
  return {"compressed point clouds, three times what the link carries",
          plan_of(200'000, {{"/points/draco", "point_cloud_interfaces/msg/CompressedPointCloud2",
                             60'000, 100ms, 0, 1, best_effort(5)}}),
          [](const Thin& thin) {
            expect_young(thin.streams()[0], thin.age_max(60'000, 1), "the clouds");
            if (thin.streams()[0].heard.size() < 25) violated("few clouds arrive");
          }};
}

Use five() {
  return {
      "five publishers of one topic on a link that carries half",
      plan_of(100'000, {{"/tracks", "geometry_msgs/msg/Pose", 2'000, 50ms, 0, 5, reliable(10)}}),
      [](const Thin& thin) { thin.check(); }};
}

// Exact, one picture would take a second.
Use camera() {
  ThinPlan plan = plan_of(
      125'000, {{"/camera/image", "sensor_msgs/msg/Image", 200'000, 33ms, 0, 1, best_effort(5)}});
  plan.treatment.compression = {.automatic = true};
  plan.treatment.lossy = Lossy::kAuto;
  return {"a camera on a link of 1 Mbit/s", with_break(plan, 8s, 1s), [](const Thin& thin) {
            const Stream& stream = thin.streams()[0];
            expect_young(stream, 200ms, "the pictures");
            if (stream.heard.empty() || stream.heard.front().at > TimePoint{} + 4s)
              violated("the first picture comes late");
            const double span = seconds(stream.heard.back().at - stream.heard.front().at);
            if (static_cast<double>(stream.heard.size()) < 22 * span)
              violated("few pictures arrive: " + heard_of(stream));
          }};
}

// Everything counts, and is to come after a break, too.
Use bag() {
  ThinPlan plan = plan_of(300'000, {});
  for (int i = 0; i < 20; ++i)
    plan.flows.push_back(
        {"/topic" + std::to_string(i), i % 2 == 0 ? "geometry_msgs/msg/Pose" : "my_msgs/msg/State",
         static_cast<std::size_t>(200 << (i % 5)), 200ms, 0, 1, reliable(10), 25s});
  plan.treatment.keep = Keep::kAll;
  plan.treatment.resume = true;
  return {"a bag of 20 topics, recorded at the operator, over a break", with_break(plan, 8s, 10s),
          [](const Thin& thin) {
            for (const Stream& stream : thin.streams()) expect_all(stream, "a topic of the bag");
          }};
}

// Each would take 2 s.
Use maps() {
  ThinPlan plan = plan_of(100'000, {{"/map", kGrid, 200'000, 500ms, 0, 1, latched(), 9s}});
  plan.treatment.keep = Keep::kNewest;  // by its Header, of which the simulated graph tells nothing
  plan.end = 18s;
  return {"latched maps that change", plan, [](const Thin& thin) {
            const Stream& stream = thin.streams()[0];
            expect_last(stream, "the map");
            expect_young(stream, thin.age_max(200'000, 1), "the maps");
          }};
}

// It answers after three times the silence after which a link is dead.
Use transitions() {
  ThinPlan plan = plan_of(50'000, {{"/node/transition_event", "lifecycle_msgs/msg/TransitionEvent",
                                    300, 500ms, 0, 1, reliable(10), 10s}});
  plan.call_takes = 10s;
  plan.end = 17s;
  return {"a lifecycle transition that takes longer than dead_after", plan, [](const Thin& thin) {
            if (thin.answers() != 1) violated("the transition was not answered");
            expect_all(thin.streams()[0], "its events");
          }};
}

// In plain the offers of 400 topics would take seconds of this link, at the start and after each
// break.
Use large_graph() {
  ThinPlan plan = plan_of(20'000, {});
  for (int node = 0; node < 40; ++node)
    for (int i = 0; i < 10; ++i)
      plan.flows.push_back(
          {"/robot/node_" + std::to_string(node) + "/state_" + std::to_string(i),
           i % 2 == 0 ? "sensor_msgs/msg/JointState" : "diagnostic_msgs/msg/DiagnosticArray", 200,
           100ms, 0, 1, reliable(10), 1ms});  // nothing is published there
  const std::size_t pose = plan.flows.size();
  plan.flows.push_back({"/robot/pose", "geometry_msgs/msg/Pose", 100, 50ms, 0, 1, reliable(10)});
  plan.flows.push_back({"/robot/cmd_vel", "geometry_msgs/msg/Twist", 60, 50ms, 1, 1, reliable(10)});
  constexpr Duration kBreakAt = 10s;
  constexpr Duration kBreakFor = 2s;
  return {"a large graph, watched and driven over a reset of two seconds",
          with_break(plan, kBreakAt, kBreakFor), [=](const Thin& thin) {
            // A second, and up to half a one for the next dial.
            const TimePoint back = TimePoint{} + kBreakAt + kBreakFor;
            for (const std::size_t index : {pose, pose + 1}) {
              const Stream& stream = thin.streams()[index];
              const std::string what = index == pose ? "the pose" : "the command";
              const auto after = std::find_if(stream.heard.begin(), stream.heard.end(),
                                              [&](const auto& heard) { return heard.at >= back; });
              if (stream.heard.empty() || stream.heard.front().at > TimePoint{} + 3s)
                violated(what + " comes late at first");
              if (after == stream.heard.end() || after->at > back + 1500ms)
                violated(what + " comes late after the reset");
            }
          }};
}

}  // namespace

std::vector<Use> uses() {
  return {costmap(), markers(), trajectories(), clouds(),      camera(),
          five(),    bag(),     maps(),         transitions(), large_graph()};
}

}  // namespace connect_bridge::sim
