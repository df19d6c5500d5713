// The real publishers of one local topic.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/base/timers.hpp"
#include "core/graph/graph_view.hpp"
#include "core/ports/inputs.hpp"

namespace connect_bridge {

class LocalTopic;
using ExportTimers = Timers<LocalTopic*>;
using TopicTimers = ExportTimers::Of;

struct Origin {
  OriginId id;
  std::string node;  // empty: not in the graph (yet)
  Qos qos;
  std::uint64_t last_number = 0;  // transient local: of the newest sample that was forwarded
  std::uint64_t kept = 0;         // samples that it had kept for the subscription and that came
  ExportTimers::Timer vanishes;   // set: its publisher has left the graph
  bool lingering = false;         // it has left, but its samples still wait in a queue
  bool seen = false;              // while a graph is compared
};

// A publisher that left the graph keeps its origin for a moment: its last samples may still be on
// their way from the middleware to us (`ros2 topic pub --once` ends right after its message), or in
// our queues.
class Origins {
 public:
  explicit Origins(TopicTimers timers) : timers_(timers) {}

  // Compares with the graph (null: the topic is not in it). Returns the origins to report to the
  // peers: new ones, and those whose node has got a name.
  std::vector<Gid> update(const TopicState* state, const Now& now);
  // Removes the origins whose time is over. `drained`: no sample of the topic waits anywhere;
  // `is_kept`: a sample of the origin waits for a link to return, which has a time limit of its
  // own.
  std::vector<OriginId> remove_vanished(bool drained, const std::function<bool(OriginId)>& is_kept,
                                        const Now& now);
  // The subscription has ended, and the next one may deliver the same samples again.
  void forget_samples();

  // For a zero gid (the middleware does not report the publisher) the first origin is returned. Of
  // several whose samples are kept (a transient-local subscription) each has its turn, and as many
  // samples as it keeps: together they keep the last ones of the topic, whose ever these are.
  [[nodiscard]] Origin* find(const Gid& gid, Durability subscribed = Durability::kVolatile);
  // Gives a sample of a publisher that keeps its samples the number by which it is known: the
  // middleware's, else its stamp. One that may be of several publishers has none. (What comes by a
  // subscription for listeners, which was there before the publisher, comes again by the one that
  // follows and may cross twice: the mirror knows it.)
  void number(MessageTaken& taken) const;
  // Whether a transient-local sample of the origin, which has its number, has not been forwarded
  // before. One without a number is always new.
  [[nodiscard]] static bool is_new(Origin& origin, const MessageTaken& taken);
  // Whether the publisher had kept this new sample, which may be older than the subscription, for a
  // late subscriber: no more than `depth` of it came before.
  [[nodiscard]] static bool was_kept(Origin& origin, std::uint64_t depth);
  [[nodiscard]] const Origin& at(const Gid& gid) const { return origins_.at(gid); }
  [[nodiscard]] bool empty() const { return origins_.empty(); }
  [[nodiscard]] std::size_t size() const { return origins_.size(); }
  [[nodiscard]] auto begin() const { return origins_.begin(); }
  [[nodiscard]] auto end() const { return origins_.end(); }

 private:
  TopicTimers timers_;
  std::map<Gid, Origin> origins_;  // in an order that does not depend on the library
  std::uint32_t last_ = 0;
  std::uint64_t turns_ = 0;  // of samples whose publisher is not reported
};

}  // namespace connect_bridge
