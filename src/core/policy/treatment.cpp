#include "core/policy/treatment.hpp"

#include <algorithm>
#include <array>

namespace connect_bridge {
namespace {

// ---- what is known of types

enum Trait : unsigned {
  kUrgent = 1,  // a person or a controller steers with it
  kHigh = 2,
  kBulk = 4,   // large
  kMoves = 8,  // what it starts takes longer than it does: trajectories, jogging, set points
  kPicture = 16,
  kState = 32,  // without a Header; a newer one replaces it
  kEvent = 64,  // each one counts, whatever its QoS
};
struct KnownType {
  std::string_view type;
  unsigned traits;
};
constexpr auto kKnownTypes = std::to_array<KnownType>({
    {"geometry_msgs/msg/Twist", kUrgent | kState},
    {"geometry_msgs/msg/TwistStamped", kUrgent},
    {"sensor_msgs/msg/Joy", kUrgent},
    {"ackermann_msgs/msg/AckermannDrive", kUrgent | kState},
    {"ackermann_msgs/msg/AckermannDriveStamped", kUrgent},
    {"rosgraph_msgs/msg/Clock", kUrgent | kState},
    {"tf2_msgs/msg/TFMessage", kHigh | kState},
    {"sensor_msgs/msg/JointState", kHigh},
    {"sensor_msgs/msg/MultiDOFJointState", kHigh},
    {"action_msgs/msg/GoalStatusArray", kHigh | kEvent},
    {"trajectory_msgs/msg/JointTrajectory", kMoves},
    {"trajectory_msgs/msg/MultiDOFJointTrajectory", kMoves},
    {"control_msgs/msg/JointJog", kMoves},
    {"mavros_msgs/msg/PositionTarget", kMoves},
    {"mavros_msgs/msg/AttitudeTarget", kMoves},
    {"mavros_msgs/msg/OverrideRCIn", kMoves},
    {"autoware_control_msgs/msg/Control", kMoves},
    {"px4_msgs/msg/TrajectorySetpoint", kMoves},
    {"px4_msgs/msg/VehicleRatesSetpoint", kMoves},
    {"px4_msgs/msg/VehicleCommand", kMoves},
    {"unitree_go/msg/LowCmd", kMoves},
    {"unitree_hg/msg/LowCmd", kMoves},
    {"sensor_msgs/msg/Image", kBulk | kPicture},
    {"sensor_msgs/msg/CompressedImage", kBulk | kPicture},
    {"stereo_msgs/msg/DisparityImage", kBulk | kPicture},
    // A picture of a video is the difference to the one before.
    {"theora_image_transport/msg/Packet", kBulk | kPicture | kEvent},
    {"ffmpeg_image_transport_msgs/msg/FFMPEGPacket", kBulk | kPicture | kEvent},
    {"foxglove_msgs/msg/CompressedVideo", kBulk | kPicture | kEvent},
    {"sensor_msgs/msg/PointCloud", kBulk},
    {"sensor_msgs/msg/PointCloud2", kBulk},
    {"sensor_msgs/msg/MultiEchoLaserScan", kBulk},
    {"nav_msgs/msg/OccupancyGrid", kBulk},
    {"nav_msgs/msg/GridCells", kBulk},
    {"map_msgs/msg/OccupancyGridUpdate", kBulk},
    {"map_msgs/msg/PointCloud2Update", kBulk},
    {"map_msgs/msg/ProjectedMap", kBulk},
    {"nav2_msgs/msg/Costmap", kBulk},
    {"nav2_msgs/msg/CostmapUpdate", kBulk},
    {"nav2_msgs/msg/VoxelGrid", kBulk},
    {"visualization_msgs/msg/MarkerArray", kBulk | kEvent},
    {"visualization_msgs/msg/InteractiveMarkerInit", kBulk},
    {"shape_msgs/msg/Mesh", kBulk},
    {"octomap_msgs/msg/Octomap", kBulk},
    {"octomap_msgs/msg/OctomapWithPose", kBulk},
    {"grid_map_msgs/msg/GridMap", kBulk},
    {"velodyne_msgs/msg/VelodyneScan", kBulk},
    {"moveit_msgs/msg/PlanningScene", kBulk},
    {"geometry_msgs/msg/Accel", kState},
    {"geometry_msgs/msg/Wrench", kState},
    {"geometry_msgs/msg/Pose", kState},
    {"geometry_msgs/msg/Pose2D", kState},
    {"geometry_msgs/msg/Point", kState},
    {"geometry_msgs/msg/Point32", kState},
    {"geometry_msgs/msg/Vector3", kState},
    {"geometry_msgs/msg/Quaternion", kState},
    {"geometry_msgs/msg/Transform", kState},
    {"rcl_interfaces/msg/Log", kEvent},
    {"rcl_interfaces/msg/ParameterEvent", kEvent},
    {"lifecycle_msgs/msg/TransitionEvent", kEvent},
    {"diagnostic_msgs/msg/DiagnosticArray", kEvent},
    {"diagnostic_msgs/msg/DiagnosticStatus", kEvent},
    {"visualization_msgs/msg/Marker", kEvent},
    {"visualization_msgs/msg/ImageMarker", kEvent},
    {"mavros_msgs/msg/Mavlink", kEvent},
    {"mavros_msgs/msg/RTCM", kEvent},
});

bool has(std::string_view type, Trait trait) {
  const auto* const known = std::ranges::find(kKnownTypes, type, &KnownType::type);
  return known != kKnownTypes.end() && (known->traits & trait) != 0;
}

bool is_one_of(std::string_view text, const auto& list) {
  return std::ranges::find(list, text) != list.end();
}

bool is_event(std::string_view type) {
  constexpr std::array<std::string_view, 3> kPackages = {"can_msgs", "rtcm_msgs", "nmea_msgs"};
  return has(type, kEvent) || type.ends_with("_FeedbackMessage") || type.ends_with("Update") ||
         is_one_of(type.substr(0, type.find('/')), kPackages);
}

// ---- names

// FNV-1a.
std::uint64_t hash_of(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325;
  constexpr std::uint64_t kPrime = 0x100000001b3;
  for (const char c : text) hash = (hash ^ static_cast<std::uint8_t>(c)) * kPrime;
  return hash;
}

std::string_view parent_of(std::string_view name) {
  return name.substr(0, std::min(name.rfind('/'), name.size()));
}

// The last token of a topic of image_transport or point_cloud_transport.
bool is_form(std::string_view token) {
  constexpr std::array<std::string_view, 8> kForms = {
      "compressed", "compressedDepth", "theora", "zstd", "zlib", "draco", "cloudini", "ffmpeg"};
  return is_one_of(token, kForms);
}

}  // namespace

// ---- priority, and what comes late

Priority default_priority(std::string_view topic, std::string_view type) {
  if (topic == "/clock" || has(type, kUrgent)) return Priority::kUrgent;
  if (topic == "/tf" || topic == "/tf_static" || has(type, kHigh)) return Priority::kHigh;
  return has(type, kBulk) ? Priority::kBulk : Priority::kNormal;
}

bool drives(const Treatment& treatment, std::string_view topic, std::string_view type) {
  // A person's clicks in RViz, for Nav2.
  constexpr std::array<std::string_view, 2> kClicks = {"goal_pose", "initialpose"};
  if (treatment.drives) return *treatment.drives;
  return default_priority(topic, type) == Priority::kUrgent || has(type, kMoves) ||
         is_one_of(topic.substr(topic.rfind('/') + 1), kClicks);
}

bool is_picture(std::string_view type) {
  return has(type, kPicture);
}

bool has_planes(std::string_view type) {
  return type == "sensor_msgs/msg/Image";
}

bool is_cloud(std::string_view type) {
  return type == "sensor_msgs/msg/PointCloud2";
}

bool resumes(const Treatment& treatment, std::string_view topic, std::string_view type) {
  // A command drives whatever priority a rule gives it.
  const bool may_be_late = treatment.priority != Priority::kUrgent &&
                           !drives(treatment, topic, type) && !is_picture(type);
  return treatment.resume.value_or(may_be_late &&
                                   treatment.max_age == kForever);  // mutant: commands_kept
}

// ---- which messages count

KeepDecision keep_of(const Treatment& treatment, std::string_view type, const TopicTraits& traits) {
  if (treatment.keep) return {*treatment.keep, "the rule says so"};
  if (is_event(type)) return {Keep::kAll, "each message of this type counts"};
  if (traits.keep_all) return {Keep::kAll, "a publisher keeps all"};
  if (traits.latched > 1)
    return {Keep::kAll, "a publisher keeps more than one for late subscribers"};
  if (has(type, kState)) return {Keep::kNewest, "the type tells a state"};
  if (traits.best_effort) return {Keep::kNewest, "best effort"};
  if (traits.has_header) return {Keep::kNewest, "the type begins with a Header"};
  return {Keep::kAll, "reliable, and not known to be a state"};
}

// ---- changed rules

bool may_follow(Treatment before, const Treatment& after) {
  before.with_large = after.with_large;
  before.max_rate = after.max_rate;
  before.bytes_per_second_max = after.bytes_per_second_max;
  before.max_age = after.max_age;
  before.queue_bytes_max = after.queue_bytes_max;
  // Keys of imports and of services.
  before.wheel = after.wheel;
  before.halt_after = after.halt_after;
  before.let_go = after.let_go;
  before.calls_max = after.calls_max;
  before.server_queue = after.server_queue;
  before.call_timeout = after.call_timeout;
  before.cancel_after = after.cancel_after;
  before.allow_type_mismatch = after.allow_type_mismatch;
  return before == after;
}

// ---- what belongs together

Company company_of(std::string_view topic, std::string_view type, const Treatment& treatment) {
  const Priority by_type = default_priority(topic, type);
  const Priority priority = treatment.priority.value_or(by_type);
  if (treatment.with_large.value_or(type == "sensor_msgs/msg/CameraInfo"))
    return priority < Priority::kNormal ? Company::kNone : Company::kFollows;
  const bool large = by_type == Priority::kBulk || priority == Priority::kBulk;
  return large ? Company::kLarge : Company::kNone;
}

std::uint64_t company_namespace(std::string_view topic, Company company) {
  std::string_view base = parent_of(topic);
  if (company == Company::kLarge && is_form(topic.substr(base.size() + 1))) base = parent_of(base);
  return hash_of(base);
}

std::uint64_t company_node(std::string_view node) {
  return node.empty() ? 0 : hash_of(node);
}

}  // namespace connect_bridge
