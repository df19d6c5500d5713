#include "core/topics/mirror_qos.hpp"

#include <algorithm>

namespace connect_bridge {
namespace {

// A peer cannot make the middleware monitor shorter periods.
constexpr Duration kPeriodMin = std::chrono::milliseconds(1);

}  // namespace

Qos mirror_qos(const Qos& origin, const QosOverride& ruled, const TopicOptions& options) {
  // The depth that a peer asks for has a limit; otherwise a transient-local mirror would keep all
  // that the peer ever sends, and any other would block the loop for a subscriber that does not
  // take its samples.
  const std::uint32_t depth_max = options.mirror_depth_max;
  const bool keep_all = origin.history == History::kKeepAll;
  Qos qos = origin;
  qos.depth = keep_all ? depth_max : std::min(qos.depth, depth_max);
  qos.history = History::kKeepLast;
  // The operator's rule comes after the limits for peers, and may ask for more.
  qos = with_override(qos, ruled);
  const bool latched = qos.durability == Durability::kTransientLocal;
  if (qos.depth == 0) qos.depth = latched ? options.latched_depth : options.default_depth;
  for (Duration* period : {&qos.deadline, &qos.lifespan, &qos.liveliness_lease})
    *period = std::max(*period, kPeriodMin);
  return qos;
}

bool may_resume(const Qos& origin, const Qos& mirror) {
  return origin.reliability == Reliability::kReliable &&
         origin.durability == Durability::kVolatile && mirror.reliability == Reliability::kReliable;
}

}  // namespace connect_bridge
