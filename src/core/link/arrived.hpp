// The state of arrival of a link's topics, for the link's return.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "core/base/budget.hpp"
#include "core/base/ids.hpp"

namespace connect_bridge {

struct Arrived {
  // Limit of entries of a link: one that breaks again and again may have other topics each time. A
  // topic beyond the limit is not resumed.
  static constexpr std::size_t kOriginsMax = 1024;
  static constexpr std::uint64_t kOriginBytes = 80;  // memory of one entry of the set

  std::uint32_t sequence = 0;  // of the last message
  std::set<Gid> origins = {};  // their mirrors ended with the link: other bridges may have them now
  Budget::Hold held = {};
};
// Keyed by topic and type (local names). Holds topics for which the peer was asked to keep messages
// that do not arrive. A topic with an entry resumes when the link is back.
using ArrivedTopics = std::map<std::pair<std::string, std::string>, Arrived>;

// Notes that the mirror of this origin ends with the link, in a little of the link's memory.
// Without room the topic does not resume.
inline void note_end(ArrivedTopics& topics, const ArrivedTopics::key_type& topic, const Gid& origin,
                     Budget& memory) {
  const auto at = topics.find(topic);
  if (at == topics.end()) return;
  Arrived& arrived = at->second;
  if (!arrived.origins.insert(origin).second) return;
  if (arrived.origins.size() > Arrived::kOriginsMax || memory.room() < Arrived::kOriginBytes) {
    topics.erase(at);
    return;
  }
  arrived.held.release();
  arrived.held = memory.hold(arrived.origins.size() * Arrived::kOriginBytes);
}

// Another bridge of the graph brings these messages now: they must not come again when the link is
// back.
template <class IsClaimed>
void forget_origins(ArrivedTopics& topics, const IsClaimed& is_claimed) {
  std::erase_if(topics, [&](const auto& topic) {
    const auto& origins = topic.second.origins;
    return std::any_of(origins.begin(), origins.end(), is_claimed);
  });
}

}  // namespace connect_bridge
