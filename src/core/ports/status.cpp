#include "core/ports/status.hpp"

#include <algorithm>
#include <iterator>

namespace connect_bridge {
namespace {

bool is_used(const TopicStatus& topic) {
  return topic.demanded || topic.messages > 0;
}

bool is_used(const ServiceStatus& service) {
  return service.calls > 0;
}

// A peer may offer thousands.
template <class Shown>
std::vector<Shown> take_further(std::vector<Shown>& all) {
  if (all.size() <= LinkStatus::kShownMax) return {};
  std::stable_partition(all.begin(), all.end(), [](const Shown& one) { return is_used(one); });
  const auto first = all.begin() + LinkStatus::kShownMax;
  std::vector<Shown> further(std::make_move_iterator(first), std::make_move_iterator(all.end()));
  all.erase(first, all.end());
  return further;
}

}  // namespace

void LinkStatus::sum_up() {
  further_services = take_further(services).size();
  for (const TopicStatus& topic : take_further(topics)) {
    ++further_topics;
    further.add_past(topic);
    further.queued += topic.queued;
  }
}

}  // namespace connect_bridge
