// What arrived of a link's topics, for when the link is back.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/base/ids.hpp"

namespace connect_bridge {

struct Arrived {
  std::uint32_t sequence = 0;     // of the last message
  std::vector<Gid> origins = {};  // their mirrors ended with the link: others may have them now
};
// By topic and type (local names), where the peer was asked to keep what does not arrive. With an
// entry the topic goes on when the link is back.
using ArrivedTopics = std::map<std::pair<std::string, std::string>, Arrived>;

// The mirror of this origin ends with the link.
inline void note_end(ArrivedTopics& topics, const ArrivedTopics::key_type& topic,
                     const Gid& origin) {
  if (const auto at = topics.find(topic); at != topics.end()) at->second.origins.push_back(origin);
}

// What another bridge of the graph brings meanwhile must not come again when the link is back.
template <class IsClaimed>
void forget_origins(ArrivedTopics& topics, const IsClaimed& is_claimed) {
  std::erase_if(topics, [&](const auto& topic) {
    const auto& origins = topic.second.origins;
    return std::any_of(origins.begin(), origins.end(), is_claimed);
  });
}

}  // namespace connect_bridge
