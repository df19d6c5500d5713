// State that the mirrors and the offered topics of a side share.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/base/timers.hpp"
#include "core/graph/side_view.hpp"
#include "core/topics/options.hpp"
#include "core/topics/topic_mirror.hpp"

namespace connect_bridge {

struct ImportContext : SideView {
  const TopicOptions& options;

  std::optional<TimePoint> graph_since{};  // no mirror before the first picture of the local graph
  Timers<TopicMirror*> timers{};
  Timers<PeerTopic*> held{};  // messages that a rate holds back
  // When topics look again whether there are mirrors for origins that they have left out.
  std::optional<TimePoint> looks_again_at{};
  std::uint64_t judged = 0;            // demands of topics, so often
  std::set<LinkId> demands_changed{};  // links on which demands are to be sent
  // The mirrors that exist in the graph, and their ids there; all zero: not told, or not needed by
  // others.
  struct Made {
    TopicMirror* mirror;
    Gid gid = {};
  };
  std::map<MirrorId, Made> made{};
  std::vector<Gid> unmade{};  // ids of those that have ended, to be told
  std::map<MirrorKey, TopicMirror> mirrors{};

  // The mirror of this origin that the link offers, made if need be. Null: there are too many.
  [[nodiscard]] TopicMirror* mirror_of(const MirrorKey& key, const Link& link);
  // Those of origins that the link offers, or is expected to offer again, in their order.
  [[nodiscard]] std::vector<TopicMirror*> mirrors_of(const Link& link);
  // It does not exist in the graph any more.
  void unmake(MirrorId mirror) {
    if (const auto ended = made.extract(mirror); ended.mapped().gid != Gid{})
      unmade.push_back(ended.mapped().gid);
  }
  void look_again(const Now& now, Duration after = std::chrono::seconds(1)) {
    looks_again_at = earliest(looks_again_at, now.steady + after);
  }
  // How many samples of this size the mirror may keep of those that it keeps for late subscribers
  // (`depth`).
  [[nodiscard]] std::uint32_t mirror_depth(const TopicMirror& mirror, std::uint32_t depth,
                                           std::uint64_t sample_bytes) const;
  // The bytes that the mirror may keep beside the others that its link feeds: within
  // mirror_bytes_max, and within what it keeps now and this part (1 / share, of 4 or more) of what
  // is left to the link.
  [[nodiscard]] std::uint64_t mirror_room(const TopicMirror& mirror, std::uint64_t share) const;
  // A line about a mirror has words of its peer: it is told once for the identity, and not at all
  // where nobody offers the mirror any longer.
  void tell_once(const TopicMirror& mirror, LogLevel level, const std::string& text) const;
  // Says in the log why the mirror could not be made.
  void tell_failed(const TopicMirror& mirror, const MirrorFailed& failed) const;
  // Says in the log that the type here is not the one of the peer: `used`, the rules use it
  // nevertheless.
  void tell_difference(const TopicMirror& mirror, const std::string& hash_here, bool used) const;
  // Nobody listens, and nothing comes from `feeder`: what the mirror keeps for late subscribers
  // grows stale, so it is made again without. They get the origin's last samples. False: it has to
  // stay.
  [[nodiscard]] bool forget_kept(const std::map<OriginId, TopicMirror*>& origins,
                                 const PeerTopic& feeder, const Now& now) const;
  // What some subscriber here requests and none of these mirrors offers; empty: nothing.
  [[nodiscard]] std::string misfit(const TopicKey& topic,
                                   const std::map<OriginId, TopicMirror*>& origins) const;
  // The link does not offer the origin any more. The mirror may end with that.
  void remove_candidate(TopicMirror& mirror, LinkId link, const Now& now);
};

}  // namespace connect_bridge
