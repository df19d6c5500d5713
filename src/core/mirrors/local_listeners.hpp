// Reports the subscribed topics of this side's graph to peers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

#include "core/graph/side_view.hpp"
#include "core/link/link.hpp"
#include "core/link/link_news.hpp"

namespace connect_bridge {

// Reports the topics that have a subscription here and that our rules let the peer publish. The
// peer need not offer them: after the report the topic exists there, too. Each link gets the
// changes since the last report, and all on a new connection: so many in a step
// (GraphOptions::listeners_at_once), and links take turns (LinkNews). Endpoints of bridges are not
// listeners (GraphView does not contain them). Single-threaded.
class LocalListeners {
 public:
  explicit LocalListeners(const SideView& side) : side_(side) {}

  // A step of the side begins.
  void begin_step() { left_ = side_.graph_options.listeners_at_once * kLooks; }
  // The link is open, and has no report yet.
  void begin(Link& link, const Now& now);
  // Nodes have begun or ended to subscribe to these topics.
  void on_graph(const GraphDifference& difference, const Now& now);
  // Our rules or the link's identity have changed. What they take away is reported at once, and the
  // rest with go_on().
  void recheck(Link& link);
  void on_link_lost(LinkId link);
  // Reports what is due, as much as is left for this step.
  void go_on(const Now& now) { go_on(false, now); }
  // The same in a step that is for this: each identity pays for its links.
  void on_time(const Now& now) {
    if (goes_on_at_ && *goes_on_at_ <= now.steady) go_on(true, now);
  }
  [[nodiscard]] std::optional<TimePoint> deadline() const { return goes_on_at_; }

 private:
  struct Reported {
    std::map<TopicKey, ListenerId> listeners;
    std::uint32_t last = 0;
  };
  using OfLink = LinkNews<TopicKey>::OfLink;

  // A report takes as long as so many looks at topics that need none.
  static constexpr std::size_t kLooks = 4;

  void go_on(bool pays, const Now& now);
  // True: nothing is due at the link any more.
  [[nodiscard]] bool tell(OfLink& of);
  // Adds the report that the topic needs.
  void look(const TopicKey& topic, OfLink& of, Reported& reported, Listeners& change) const;
  [[nodiscard]] bool is_listened_to(const Link& link, const TopicKey& topic,
                                    const TopicState* state) const;

  const SideView side_;
  LinkNews<TopicKey> news_;
  std::map<LinkId, Reported> links_;
  std::size_t left_ = 0;  // of what this step may do; a look takes 1
  std::optional<TimePoint> goes_on_at_;
};

}  // namespace connect_bridge
