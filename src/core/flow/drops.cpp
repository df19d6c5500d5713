#include "core/flow/drops.hpp"

namespace connect_bridge {

std::string_view name_of(DropReason reason) {
  switch (reason) {
    case DropReason::kQueueDepth: return "queue_depth";
    case DropReason::kQueueBytes: return "queue_bytes";
    case DropReason::kQueueTime: return "queue_time";
    case DropReason::kLifespan: return "lifespan";
    case DropReason::kMaxAge: return "max_age";
    case DropReason::kRate: return "rate";
    case DropReason::kTooLarge: return "too_large";
    case DropReason::kNoDemand: return "no_demand";
    case DropReason::kWithdrawn: return "withdrawn";
    case DropReason::kLinkLost: return "link_lost";
    case DropReason::kUnknownOrigin: return "unknown_origin";
    case DropReason::kDuplicate: return "duplicate";
    case DropReason::kNewerAvailable: return "newer_available";
    case DropReason::kPublishFailed: return "publish_failed";
    case DropReason::kMemory: return "memory";
    case DropReason::kNotPermitted: return "not_permitted";
    case DropReason::kResumeBound: return "resume_bound";
    case DropReason::kLostHere: return "lost_here";
    case DropReason::kWheel: return "wheel";
    case DropReason::kGroup: return "group";
    case DropReason::kCount: break;
  }
  return "unknown";
}

}  // namespace connect_bridge
