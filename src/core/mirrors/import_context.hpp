// State that the mirrors and the peer topics of a side share.
#pragma once

#include <cstdint>
#include <optional>
#include <set>

#include "core/base/timers.hpp"
#include "core/base/turns.hpp"
#include "core/graph/side_view.hpp"
#include "core/mirrors/clock_publisher.hpp"
#include "core/mirrors/mirror_table.hpp"
#include "core/mirrors/wheels.hpp"
#include "core/topics/options.hpp"

namespace connect_bridge {

struct ImportContext : SideView {
  const TopicOptions& options;

  std::optional<TimePoint> graph_since{};  // no mirror before the first picture of the local graph
  Timers<PeerTopic*> held{};               // messages that a rate holds back
  // When topics look again for places for their left-out origins.
  std::optional<TimePoint> looks_again_at{};
  // The links of these topics, each once: identities take turns, then links within one.
  TurnsOfGroups<std::uint64_t, LinkId, LinkId> without_place{};
  std::uint64_t judged = 0;            // counts how often demands of topics were judged
  std::set<LinkId> demands_changed{};  // links on which demands are to be sent
  Wheels wheels{};                     // of topics that drive this robot
  MirrorTable mirrors{*this};

  void look_again(const Now& now, Duration after = std::chrono::seconds(1)) {
    looks_again_at = earliest(looks_again_at, now.steady + after);
  }
  // Nodes here, or at a peer whose /clock is imported, use simulated time.
  [[nodiscard]] bool has_simulated_time() const {
    const TopicState* const here = graph.find({"/clock", kClockType});
    return options.clock_publish_period > Duration::zero() || (here && !here->publishers.empty()) ||
           mirrors.has_type(kClockType);
  }
};

}  // namespace connect_bridge
