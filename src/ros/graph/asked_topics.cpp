#include "ros/graph/asked_topics.hpp"

#include <algorithm>

namespace connect_bridge::ros {

std::optional<std::string> AskedTopics::take_due(TimePoint now) {
  const auto at = std::find_if(topics_.begin(), topics_.end(),
                               [&](const auto& entry) { return entry.second.due <= now; });
  if (at == topics_.end()) return std::nullopt;
  std::string topic = at->first;
  Asked& asked = at->second;
  asked.due = now + kPause * (1 << asked.readings);
  if (++asked.readings == kReadingsMax) topics_.erase(at);
  return topic;
}

std::optional<AskedTopics::TimePoint> AskedTopics::deadline() const {
  const auto first = std::min_element(
      topics_.begin(), topics_.end(),
      [](const auto& one, const auto& other) { return one.second.due < other.second.due; });
  if (first == topics_.end()) return std::nullopt;
  return first->second.due;
}

}  // namespace connect_bridge::ros
