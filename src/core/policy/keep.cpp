#include "core/policy/keep.hpp"

#include <algorithm>
#include <array>

namespace connect_bridge {
namespace {

bool ends_with(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

template <std::size_t N>
bool is_one_of(std::string_view text, const std::array<std::string_view, N>& list) {
  return std::find(list.begin(), list.end(), text) != list.end();
}

// Types of which each message counts, whatever its QoS.
bool is_event(std::string_view type) {
  constexpr std::array<std::string_view, 13> kTypes = {
      "rcl_interfaces/msg/Log", "rcl_interfaces/msg/ParameterEvent",
      "lifecycle_msgs/msg/TransitionEvent", "action_msgs/msg/GoalStatusArray",
      "diagnostic_msgs/msg/DiagnosticArray", "diagnostic_msgs/msg/DiagnosticStatus",
      "visualization_msgs/msg/Marker", "visualization_msgs/msg/MarkerArray",
      "visualization_msgs/msg/ImageMarker", "mavros_msgs/msg/Mavlink", "mavros_msgs/msg/RTCM",
      // A picture of a video is the difference to the one before.
      "theora_image_transport/msg/Packet", "ffmpeg_image_transport_msgs/msg/FFMPEGPacket"};
  constexpr std::array<std::string_view, 3> kPackages = {"can_msgs", "rtcm_msgs", "nmea_msgs"};
  return is_one_of(type, kTypes) || type == "foxglove_msgs/msg/CompressedVideo" ||
         ends_with(type, "_FeedbackMessage") || ends_with(type, "Update") ||
         is_one_of(type.substr(0, type.find('/')), kPackages);
}

// States without a Header.
bool is_state(std::string_view type) {
  constexpr std::array<std::string_view, 13> kTypes = {"geometry_msgs/msg/Twist",
                                                       "geometry_msgs/msg/Accel",
                                                       "geometry_msgs/msg/Wrench",
                                                       "geometry_msgs/msg/Pose",
                                                       "geometry_msgs/msg/Pose2D",
                                                       "geometry_msgs/msg/Point",
                                                       "geometry_msgs/msg/Point32",
                                                       "geometry_msgs/msg/Vector3",
                                                       "geometry_msgs/msg/Quaternion",
                                                       "geometry_msgs/msg/Transform",
                                                       "ackermann_msgs/msg/AckermannDrive",
                                                       "tf2_msgs/msg/TFMessage",
                                                       "rosgraph_msgs/msg/Clock"};
  return is_one_of(type, kTypes);
}

}  // namespace

KeepDecision keep_of(const Treatment& treatment, std::string_view type, const TopicTraits& traits) {
  if (treatment.keep) return {*treatment.keep, "the rule says so"};
  if (is_event(type)) return {Keep::kAll, "each message of this type counts"};
  if (traits.keep_all) return {Keep::kAll, "a publisher keeps all"};
  if (traits.latched > 1)
    return {Keep::kAll, "a publisher keeps more than one for late subscribers"};
  if (is_state(type)) return {Keep::kNewest, "the type tells a state"};
  if (traits.best_effort) return {Keep::kNewest, "best effort"};
  if (traits.has_header) return {Keep::kNewest, "the type begins with a Header"};
  return {Keep::kAll, "reliable, and not known to be a state"};
}

}  // namespace connect_bridge
