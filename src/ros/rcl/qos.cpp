#include "ros/rcl/qos.hpp"

#include <rmw/qos_profiles.h>

#include <algorithm>
#include <limits>

namespace connect_bridge::ros {
namespace {

// DDS represents "forever" as 2^31-1 seconds, rmw as 2^63-1 ns; 0 means "not given".
constexpr std::uint64_t kForeverSeconds = 0x7fffffff;

Duration from_rmw(const rmw_time_t& time) {
  if (time.sec >= kForeverSeconds || (time.sec == 0 && time.nsec == 0)) return kForever;
  return std::chrono::seconds(time.sec) + std::chrono::nanoseconds(time.nsec);
}

rmw_time_t to_rmw(Duration duration) {
  if (duration == kForever || duration <= Duration::zero()) return RMW_DURATION_UNSPECIFIED;
  const auto count = static_cast<std::uint64_t>(duration.count());
  return rmw_time_t{count / 1000000000U, count % 1000000000U};
}

}  // namespace

Qos from_rmw(const rmw_qos_profile_t& profile) {
  Qos qos;
  qos.reliability = profile.reliability == RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT
                        ? Reliability::kBestEffort
                        : Reliability::kReliable;
  qos.durability = profile.durability == RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL
                       ? Durability::kTransientLocal
                       : Durability::kVolatile;
  qos.history =
      profile.history == RMW_QOS_POLICY_HISTORY_KEEP_ALL ? History::kKeepAll : History::kKeepLast;
  if (profile.history == RMW_QOS_POLICY_HISTORY_KEEP_LAST) {
    constexpr std::size_t kMax = std::numeric_limits<std::int32_t>::max();
    qos.depth = static_cast<std::uint32_t>(std::min(profile.depth, kMax));
  }
  qos.deadline = from_rmw(profile.deadline);
  qos.lifespan = from_rmw(profile.lifespan);
  qos.liveliness = profile.liveliness == RMW_QOS_POLICY_LIVELINESS_MANUAL_BY_TOPIC
                       ? Liveliness::kManualByTopic
                       : Liveliness::kAutomatic;
  qos.liveliness_lease = from_rmw(profile.liveliness_lease_duration);
  return qos;
}

rmw_qos_profile_t to_rmw(const Qos& qos) {
  rmw_qos_profile_t profile = rmw_qos_profile_default;
  profile.reliability = qos.reliability == Reliability::kBestEffort
                            ? RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT
                            : RMW_QOS_POLICY_RELIABILITY_RELIABLE;
  profile.durability = qos.durability == Durability::kTransientLocal
                           ? RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL
                           : RMW_QOS_POLICY_DURABILITY_VOLATILE;
  profile.history = qos.history == History::kKeepAll ? RMW_QOS_POLICY_HISTORY_KEEP_ALL
                                                     : RMW_QOS_POLICY_HISTORY_KEEP_LAST;
  profile.depth = std::max<std::size_t>(qos.depth, 1);
  profile.deadline = to_rmw(qos.deadline);
  profile.lifespan = to_rmw(qos.lifespan);
  profile.liveliness = qos.liveliness == Liveliness::kManualByTopic
                           ? RMW_QOS_POLICY_LIVELINESS_MANUAL_BY_TOPIC
                           : RMW_QOS_POLICY_LIVELINESS_AUTOMATIC;
  profile.liveliness_lease_duration = to_rmw(qos.liveliness_lease);
  return profile;
}

rmw_qos_profile_t service_qos() {
  // The default keeps 10 requests, but many callers at once send more before the loop takes them.
  constexpr std::size_t kServiceDepth = 1000;
  rmw_qos_profile_t profile = rmw_qos_profile_services_default;
  profile.depth = kServiceDepth;
  return profile;
}

}  // namespace connect_bridge::ros
