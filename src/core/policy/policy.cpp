#include "core/policy/policy.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace connect_bridge {
namespace {

bool contains(const std::vector<std::string>& list, std::string_view value) {
  return std::find(list.begin(), list.end(), value) != list.end();
}

bool applies_to(const Rule& rule, const Identity& who) {
  if (rule.identities.empty() && rule.groups.empty()) return true;
  if (!who.name.empty() && contains(rule.identities, who.name)) return true;
  return std::any_of(who.groups.begin(), who.groups.end(),
                     [&](const std::string& group) { return contains(rule.groups, group); });
}

// Null: no rule can open this kind (one that a later minor version knows).
const std::vector<Pattern>* patterns_of(const Rule& rule, Direction direction, InterfaceKind kind) {
  const bool exported = direction == Direction::kExport;
  if (kind == InterfaceKind::kTopic) return exported ? &rule.export_topics : &rule.import_topics;
  if (kind == InterfaceKind::kService) {
    return exported ? &rule.export_services : &rule.import_services;
  }
  if (kind == InterfaceKind::kAction) return exported ? &rule.export_actions : &rule.import_actions;
  return nullptr;
}

bool type_allowed(const std::vector<std::string>& types, std::string_view type) {
  return types.empty() || contains(types, type);
}

// An action's hidden services and topics are opened by the action's name alone.
bool is_part_of_action(std::string_view name) {
  constexpr std::string_view kToken = "/_action";
  for (auto at = name.find(kToken); at != std::string_view::npos; at = name.find(kToken, at + 1)) {
    const auto end = at + kToken.size();
    if (end == name.size() || name[end] == '/') return true;
  }
  return false;
}

// Parameters are opened by a rule's `parameters` alone: "/**" among the services must not hand out
// every node's configuration.
bool is_parameter_interface(InterfaceKind kind, std::string_view name) {
  constexpr std::array<std::string_view, 6> kServices = {
      "get_parameters",      "get_parameter_types", "set_parameters", "set_parameters_atomically",
      "describe_parameters", "list_parameters"};
  if (kind == InterfaceKind::kTopic) return name == "/parameter_events";
  if (kind != InterfaceKind::kService) return false;
  const auto last = name.substr(name.rfind('/') + 1);
  return std::find(kServices.begin(), kServices.end(), last) != kServices.end();
}

}  // namespace

std::optional<Decision> Policy::decide(Direction direction, InterfaceKind kind,
                                       std::string_view name, std::string_view type,
                                       const Identity& who) const {
  if (!is_canonical_name(name) || is_part_of_action(name)) return std::nullopt;
  if (is_parameter_interface(kind, name)) return std::nullopt;
  const Rule* first = nullptr;
  for (const auto& rule : rules_) {
    if (!applies_to(rule, who)) continue;
    for (const auto& pattern : rule.deny) {
      if (pattern.covers(name)) return std::nullopt;
    }
    if (first != nullptr || !type_allowed(rule.types, type)) continue;
    const auto* allowed = patterns_of(rule, direction, kind);
    if (allowed == nullptr) return std::nullopt;
    if (std::any_of(allowed->begin(), allowed->end(),
                    [&](const Pattern& pattern) { return pattern.matches(name); })) {
      first = &rule;
    }
  }
  if (first == nullptr) return std::nullopt;
  return Decision{first->name, first->treatment};
}

Accepts Policy::accepts(const Identity& who) const {
  Accepts result;
  for (const auto& rule : rules_) {
    if (!applies_to(rule, who)) continue;
    for (const auto& pattern : rule.deny) result.deny.push_back(pattern.text());
    if (rule.import_topics.empty()) continue;
    AcceptedNames names;
    names.types = rule.types;
    for (const auto& pattern : rule.import_topics) names.topics.push_back(pattern.text());
    result.rules.push_back(std::move(names));
  }
  return result;
}

bool accepted_by(const Accepts& accepts, std::string_view name, std::string_view type) {
  if (!is_canonical_name(name) || is_part_of_action(name)) return false;
  if (is_parameter_interface(InterfaceKind::kTopic, name)) return false;
  const bool allowed =
      std::any_of(accepts.rules.begin(), accepts.rules.end(), [&](const AcceptedNames& rule) {
        return type_allowed(rule.types, type) &&
               std::any_of(rule.topics.begin(), rule.topics.end(),
                           [&](const auto& pattern) { return pattern_matches(pattern, name); });
      });
  return allowed &&
         std::none_of(accepts.deny.begin(), accepts.deny.end(),
                      [&](const auto& pattern) { return pattern_covers(pattern, name); });
}

Priority default_priority(std::string_view name, std::string_view type) {
  constexpr std::array<std::string_view, 3> kHigh = {
      "tf2_msgs/msg/TFMessage", "sensor_msgs/msg/JointState", "sensor_msgs/msg/MultiDOFJointState"};
  constexpr std::array<std::string_view, 25> kBulk = {
      "sensor_msgs/msg/Image",
      "sensor_msgs/msg/CompressedImage",
      "sensor_msgs/msg/PointCloud",
      "sensor_msgs/msg/PointCloud2",
      "sensor_msgs/msg/MultiEchoLaserScan",
      "stereo_msgs/msg/DisparityImage",
      "nav_msgs/msg/OccupancyGrid",
      "nav_msgs/msg/GridCells",
      "map_msgs/msg/OccupancyGridUpdate",
      "map_msgs/msg/PointCloud2Update",
      "map_msgs/msg/ProjectedMap",
      "nav2_msgs/msg/Costmap",
      "nav2_msgs/msg/CostmapUpdate",
      "nav2_msgs/msg/VoxelGrid",
      "visualization_msgs/msg/MarkerArray",
      "visualization_msgs/msg/InteractiveMarkerInit",
      "shape_msgs/msg/Mesh",
      "octomap_msgs/msg/Octomap",
      "octomap_msgs/msg/OctomapWithPose",
      "grid_map_msgs/msg/GridMap",
      "theora_image_transport/msg/Packet",
      "ffmpeg_image_transport_msgs/msg/FFMPEGPacket",
      "foxglove_msgs/msg/CompressedVideo",
      "velodyne_msgs/msg/VelodyneScan",
      "moveit_msgs/msg/PlanningScene"};
  if (name == "/clock" || type == "rosgraph_msgs/msg/Clock") return Priority::kUrgent;
  if (name == "/tf" || name == "/tf_static") return Priority::kHigh;
  if (std::find(kHigh.begin(), kHigh.end(), type) != kHigh.end()) return Priority::kHigh;
  if (std::find(kBulk.begin(), kBulk.end(), type) != kBulk.end()) return Priority::kBulk;
  return Priority::kNormal;
}

NameMap::NameMap(std::string prefix, std::vector<Pair> remap)
    : prefix_(std::move(prefix)), remap_(std::move(remap)) {
  while (!prefix_.empty() && prefix_.back() == '/') prefix_.pop_back();
  if (!prefix_.empty() && prefix_.front() != '/') prefix_.insert(prefix_.begin(), '/');
}

std::string NameMap::to_local(std::string_view wire) const {
  for (const auto& pair : remap_) {
    if (pair.wire == wire) return pair.local;
  }
  return prefix_ + std::string(wire);
}

std::optional<std::string> NameMap::to_wire(std::string_view local) const {
  for (const auto& pair : remap_) {
    if (pair.local == local) return pair.wire;
  }
  if (local.substr(0, prefix_.size()) != prefix_) return std::nullopt;
  const auto wire = local.substr(prefix_.size());
  if (wire.size() < 2 || wire.front() != '/') return std::nullopt;
  // A name that remap moved elsewhere is not at its old place as well.
  for (const auto& pair : remap_) {
    if (pair.wire == wire) return std::nullopt;
  }
  return std::string(wire);
}

}  // namespace connect_bridge
