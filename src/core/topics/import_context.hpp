// State that the mirrors and the peer topics of a side share.
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
#include "core/topics/wheels.hpp"

namespace connect_bridge {

struct ImportContext : SideView {
  const TopicOptions& options;

  std::optional<TimePoint> graph_since{};  // no mirror before the first picture of the local graph
  Timers<TopicMirror*> timers{};
  Timers<PeerTopic*> held{};  // messages that a rate holds back
  // When topics look again for places for their left-out origins.
  std::optional<TimePoint> looks_again_at{};
  std::uint64_t judged = 0;            // counts how often demands of topics were judged
  std::set<LinkId> demands_changed{};  // links on which demands are to be sent
  // The mirrors that exist in the graph, and their ids there. All zero: the graph has not reported
  // the id, or other bridges do not need it.
  struct Made {
    TopicMirror* mirror;
    Gid gid = {};
  };
  std::map<MirrorId, Made> made{};
  std::vector<Gid> unmade{};  // ids of mirrors that have ended, still to be reported
  Wheels wheels{};            // of topics that drive this robot
  std::map<MirrorKey, TopicMirror> mirrors{};

  // Nodes here, or at a peer whose /clock is imported, use simulated time.
  [[nodiscard]] bool has_simulated_time() const;

  // The mirror of this origin that the link offers, created if necessary. Null: there are too many.
  [[nodiscard]] TopicMirror* mirror_of(const MirrorKey& key, const Link& link);
  // The mirrors of origins that the link offers or is expected to offer again, in key order.
  [[nodiscard]] std::vector<TopicMirror*> mirrors_of(const Link& link);
  // The mirror does not exist in the graph any more, or never did.
  void unmake(MirrorId mirror, bool existed);
  void look_again(const Now& now, Duration after = std::chrono::seconds(1)) {
    looks_again_at = earliest(looks_again_at, now.steady + after);
  }
  // The number of samples of this size that the mirror may keep; at most `depth`, the number that
  // it would keep for late subscribers.
  [[nodiscard]] std::uint32_t mirror_depth(const TopicMirror& mirror, std::uint32_t depth,
                                           std::uint64_t sample_bytes) const;
  // The bytes that the mirror may keep beside the other mirrors of its link. All of them together
  // keep at most mirror_bytes_max. This one keeps at most its bytes now and 1 / `share` (4 or more)
  // of the link's remaining room.
  [[nodiscard]] std::uint64_t mirror_room(const TopicMirror& mirror, std::uint64_t share) const;
  // Logs a line about a mirror once for the feeding peer's identity, as the line has words of that
  // peer. Without a link that offers the mirror nothing is logged.
  void tell_once(const TopicMirror& mirror, LogLevel level, const std::string& text) const;
  // Logs why the mirror could not be made.
  void tell_failed(const TopicMirror& mirror, const MirrorFailed& failed) const;
  // Logs that the type here differs from the peer's. `used`: the rules use the type nevertheless.
  void tell_difference(const TopicMirror& mirror, const std::string& hash_here, bool used) const;
  // Nobody here subscribes, and nothing comes from `feeder`: samples that the mirrors keep for late
  // subscribers become stale. So the mirrors are made again without samples; late subscribers get
  // the origin's last samples. False: the mirrors have to stay.
  [[nodiscard]] bool forget_kept(const std::map<OriginId, TopicMirror*>& origins,
                                 const PeerTopic& feeder, const Now& now) const;
  // The QoS policy that a subscriber here requests and that none of these mirrors offers; empty:
  // none.
  [[nodiscard]] std::string misfit(const TopicKey& topic,
                                   const std::map<OriginId, TopicMirror*>& origins) const;
  // The link does not offer the origin any more. The mirror may end, too.
  void remove_candidate(TopicMirror& mirror, LinkId link, const Now& now);

 private:
  // The topic's name has no mirror of this type any more, perhaps: those of other types that could
  // not be made are tried again.
  void leave_name(const TopicMirror& ended);
};

}  // namespace connect_bridge
