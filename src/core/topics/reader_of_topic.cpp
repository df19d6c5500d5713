#include "core/topics/reader_of_topic.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>

namespace connect_bridge {
namespace {

// The samples of all transient-local publishers come at once; a power of two, so that not every
// publisher that joins makes the subscription again.
std::uint32_t depth_for_all(std::uint32_t depth, std::size_t publishers) {
  constexpr std::uint64_t kMost = 1 << 16;
  return static_cast<std::uint32_t>(
      std::bit_ceil(std::min(std::uint64_t{depth} * publishers, kMost)));
}

}  // namespace

Qos qos_for(const Origins& origins, const TopicOffers& offers, const QosOverride& weakest,
            const TopicOptions& options) {
  Qos qos;
  qos.durability = origins.empty() ? Durability::kVolatile : Durability::kTransientLocal;
  std::uint32_t depth = 0;
  for (const auto& [gid, origin] : origins) {
    if (origin.qos.reliability == Reliability::kBestEffort)
      qos.reliability = Reliability::kBestEffort;
    if (origin.qos.durability == Durability::kVolatile) qos.durability = Durability::kVolatile;
    if (origin.qos.history == History::kKeepAll) qos.history = History::kKeepAll;
    depth = std::max(depth, origin.qos.depth);
  }
  for (const auto& [link, offer] : offers.busy()) {
    const QosOverride& o = offer->treatment().qos;
    // The rule of a link that wants nothing must not weaken what the others get.
    if (!offer->demanded()) continue;
    if (o.reliability == Reliability::kBestEffort) qos.reliability = Reliability::kBestEffort;
    if (o.durability == Durability::kVolatile) qos.durability = Durability::kVolatile;
    if (o.depth) depth = std::max(depth, *o.depth);
  }
  if (weakest.reliability == Reliability::kBestEffort) qos.reliability = Reliability::kBestEffort;
  if (weakest.durability == Durability::kVolatile) qos.durability = Durability::kVolatile;
  if (qos.durability == Durability::kTransientLocal) {
    depth = depth_for_all(std::max(depth, options.latched_depth), origins.size());
  }
  qos.depth = std::max(depth, options.default_depth);
  return qos;
}

}  // namespace connect_bridge
