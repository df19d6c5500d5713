// The mirrors of a side.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/timers.hpp"
#include "core/graph/claims.hpp"
#include "core/mirrors/topic_mirror.hpp"

namespace connect_bridge {

// By name, type and origin. Besides whole keys, the order knows topics and names.
struct MirrorOrder {
  using is_transparent = void;
  bool operator()(const MirrorKey& a, const MirrorKey& b) const { return a < b; }
  bool operator()(const MirrorKey& a, const TopicKey& b) const { return a.first < b; }
  bool operator()(const TopicKey& a, const MirrorKey& b) const { return a < b.first; }
  bool operator()(const MirrorKey& a, std::string_view b) const { return a.first.first < b; }
  bool operator()(std::string_view a, const MirrorKey& b) const { return a < b.first.first; }
};

// Owns the mirrors, finds them by origin, topic, name, link and id, and ends them. Knows which of
// them exist in the graph. Single-threaded.
class MirrorTable {
 public:
  using Mirrors = std::map<MirrorKey, TopicMirror, MirrorOrder>;

  // Mirrors of one topic or name, in the order of their keys.
  template <class Iterator>
  class Range {
   public:
    explicit Range(std::pair<Iterator, Iterator> range) : range_(range) {}
    [[nodiscard]] Iterator begin() const { return range_.first; }
    [[nodiscard]] Iterator end() const { return range_.second; }
    [[nodiscard]] bool empty() const { return range_.first == range_.second; }

   private:
    std::pair<Iterator, Iterator> range_;
  };

  // The context owns the table.
  explicit MirrorTable(ImportContext& context) : context_(context) {}
  MirrorTable(const MirrorTable&) = delete;
  MirrorTable& operator=(const MirrorTable&) = delete;

  // ---- finding
  // Null: there is no such mirror.
  [[nodiscard]] TopicMirror* find(const MirrorKey& key);
  [[nodiscard]] TopicMirror* find(MirrorId id) const;
  [[nodiscard]] Mirrors& all() { return mirrors_; }
  [[nodiscard]] const Mirrors& all() const { return mirrors_; }
  [[nodiscard]] auto of(const TopicKey& topic) { return Range(mirrors_.equal_range(topic)); }
  [[nodiscard]] auto of(const TopicKey& topic) const { return Range(mirrors_.equal_range(topic)); }
  // Mirrors of a name with any type.
  [[nodiscard]] auto named(std::string_view name) { return Range(mirrors_.equal_range(name)); }
  // Mirrors whose origins the link offers or is expected to offer again, in the order of keys.
  [[nodiscard]] std::vector<TopicMirror*> of(const Link& link);

  // ---- beginning and end
  // The mirror of the origin that the link offers, created if necessary. Null: there are too many.
  [[nodiscard]] TopicMirror* open(const MirrorKey& key, const Link& link);
  // The link does not offer the origin any more. The mirror may end, too.
  void remove_candidate(TopicMirror& mirror, LinkId link, const Now& now);
  // The deadlines of mirrors.
  [[nodiscard]] Timers<TopicMirror*>& timers() { return timers_; }
  [[nodiscard]] const Timers<TopicMirror*>& timers() const { return timers_; }
  // Some of the mirrors that are due. Thousands may be, as when a link has ended, and other work
  // runs between these batches.
  void on_time(const Now& now);

  // ---- in the graph
  // The publisher was requested.
  void note_created(MirrorId id, TopicMirror& mirror) { in_graph_[id] = {&mirror}; }
  // The publisher exists, with this id there. It may have been destroyed just now.
  void on_made(MirrorId id, const Gid& gid);
  // The publisher does not exist any more, or never did.
  void note_destroyed(MirrorId id, bool existed);
  // A publisher of this type exists here for a peer's.
  [[nodiscard]] bool has_type(std::string_view type) const;
  // The origins mirrored here, and the ids of the mirrors, for our own claim.
  void add_to(Claim& claim, const Now& now);

 private:
  struct InGraph {
    TopicMirror* mirror = nullptr;
    Gid gid = {};  // all zero: not reported yet, or other bridges do not need it
  };

  // The topic's name has no mirror of this type any more, perhaps: those of other types that could
  // not be made are tried again.
  void leave_name(const TopicMirror& ended);

  ImportContext& context_;
  Timers<TopicMirror*> timers_;
  std::map<MirrorId, InGraph> in_graph_;
  // Ids of mirrors in our claims. Those of mirrors that ended stay a little longer: `ended_` have
  // no time yet, `leaving_` have.
  std::multiset<Gid> claimed_;
  std::vector<Gid> ended_;
  std::deque<std::pair<TimePoint, Gid>> leaving_;
  Mirrors mirrors_;
};

}  // namespace connect_bridge
