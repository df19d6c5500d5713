#include "core/ports/status.hpp"

#include <algorithm>
#include <iterator>

namespace connect_bridge {
namespace {

bool is_used(const TopicStatus& topic) {
  return topic.demanded || topic.kept || topic.messages > 0;
}

bool is_used(const ServiceStatus& service) {
  return service.calls > 0;
}

// Takes out the entries beyond kShownMax, unused ones first: a peer may offer thousands.
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

StateWord state_of(const TopicStatus& topic) {
  if (!topic.declined.empty()) return StateWord::kDeclined;
  if (!topic.demanded) return topic.kept ? StateWord::kKept : StateWord::kNoSubscriber;
  if (topic.origins == 0) return StateWord::kNoPublisher;
  if (topic.published_for_each_sent > 1) return StateWord::kOverloaded;
  return topic.idle >= TopicStatus::kQuiet ? StateWord::kQuiet : StateWord::kFlows;
}

StateWord state_of(const ServiceStatus& service) {
  if (!service.declined.empty()) return StateWord::kDeclined;
  return service.attached ? StateWord::kReady : StateWord::kNoClient;
}

StateWord state_of(const LinkStatus& link) {
  return link.open ? StateWord::kOpen : StateWord::kLost;
}

void LinkStatus::sum_up() {
  further_services = take_further(services).size();
  for (const TopicStatus& topic : take_further(topics)) {
    ++further_topics;
    further.add_past(topic);
    further.queued += topic.queued;
  }
}

std::optional<WheelState> LinkStatus::wheel() const {
  std::optional<WheelState> most;
  for (const WheelState state :
       {WheelState::kFree, WheelState::kTaken, WheelState::kYours, WheelState::kHalted})
    for (const TopicStatus& topic : topics)
      if (topic.wheel == state) most = state;
  return most;
}

}  // namespace connect_bridge
