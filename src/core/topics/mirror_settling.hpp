// When a mirror may ask for data, so that of several bridges in one graph one feeds.
#pragma once

#include "core/base/ids.hpp"
#include "core/base/timers.hpp"
#include "core/graph/graph_view.hpp"

namespace connect_bridge {

struct ImportContext;
class Mirror;

// Data is asked for only after a settle time. Of several bridges that have just made a mirror of
// the same origin all but one will withdraw theirs when they have read each other's claims, and
// until then nothing must be published twice. Before the first graphs are discovered nobody is
// known to claim anything, so that a start takes longer; and still longer if a peer says that
// another bridge may be in this graph, until that is heard. Single-threaded; owned by the mirror.
class MirrorSettling {
 public:
  // All outlive it; `topic` has the local name.
  MirrorSettling(ImportContext& context, Mirror& mirror, const TopicKey& topic, const Gid& origin)
      : context_(context), mirror_(mirror), topic_(topic), origin_(origin) {}

  // It exists since now, under this id; it settles after `least` at the earliest.
  void begin(MirrorId id, Duration least, const Now& now);
  // It does not exist any longer.
  void end();
  // What it wants data for has changed: it does not want any for a moment at least.
  void again(const Now& now);
  // `silent`: nothing comes, as the link that fed it is lost. While another bridge is in the graph,
  // the origin is not claimed then, so that it may take over at once; afterwards it settles again,
  // without delay if nobody has done so in time.
  void release(bool silent, const Now& now);
  // What other bridges claim has changed, or which ones are waited for.
  void on_claims(const Now& now);
  // True: it has settled just now.
  bool on_time(const Now& now);

  [[nodiscard]] bool settled(const Now& now) const {
    return !settles_ || settles_.at() <= now.steady;
  }
  // It has settled since it was made: bridges whose mirror of the origin has not give way.
  [[nodiscard]] bool feeds() const { return feeds_; }
  [[nodiscard]] bool released() const { return released_; }

 private:
  // There is another bridge in the graph.
  [[nodiscard]] bool may_be_contested() const;
  void settle_at(TimePoint settled, const Now& now);
  void set_feeds(bool feeds);

  ImportContext& context_;
  Mirror& mirror_;
  const TopicKey& topic_;
  const Gid& origin_;
  MirrorId id_;
  Timers<Mirror*>::Timer settles_;
  bool waits_for_neighbours_ = false;  // `settles_` is late because a bridge has not been heard
  bool feeds_ = false;
  bool released_ = false;
  TimePoint released_at_{};  // when its link was lost
};

}  // namespace connect_bridge
