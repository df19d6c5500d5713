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
  std::uint64_t change = 0;  // when it was new, or got its node's name
  std::string node;          // empty: not in the graph (yet)
  Qos qos;
  std::uint64_t last_number = 0;  // transient local: number of the newest forwarded sample
  std::uint64_t taken = 0;        // samples, where the middleware does not number them
  std::uint64_t kept = 0;  // samples that the publisher had kept for the subscription and that came
  ExportTimers::Timer vanishes;  // set: the publisher has left the graph
  bool lingering = false;        // the publisher has left, but samples still wait in a queue
  bool seen = false;             // used while a graph is compared
};

// The publishers of one local topic. An origin stays for a moment after its publisher left the
// graph. Its last samples may still be in our queues, or in the middleware: `ros2 topic pub --once`
// exits right after its message.
class Origins {
 public:
  explicit Origins(TopicTimers timers) : timers_(timers) {}

  // Compares with the graph (null: the topic is not in it). Returns the origins to report to the
  // peers: new ones, and those whose node has got a name.
  std::vector<Gid> update(const TopicState* state, const Now& now);
  // A peer that was told of all origins up to the change `known` is told of these.
  [[nodiscard]] std::vector<Gid> changed_since(std::uint64_t known) const;
  [[nodiscard]] std::uint64_t last_change() const { return last_change_; }
  // The newest origin. Numbers rise.
  [[nodiscard]] OriginId newest() const { return {last_}; }
  // Removes and returns the origins whose time is over. `drained`: no sample of the topic waits
  // anywhere. `is_kept`: a sample of the origin waits for a link to return; the link has its own
  // time limit.
  std::vector<OriginId> remove_vanished(bool drained, const std::function<bool(OriginId)>& is_kept,
                                        const Now& now);
  // The subscription has ended, and the next one may deliver the same samples again.
  void forget_samples();

  // The origin of this publisher; null: unknown. A zero gid means that the middleware does not
  // report the publisher: then the first origin. On a transient-local subscription the origins take
  // turns instead, each with as many samples as it keeps: together they keep the topic's last
  // samples.
  [[nodiscard]] Origin* find(const Gid& gid, Durability subscribed = Durability::kVolatile);
  // Sets the number that identifies a kept sample: the middleware's, else its stamp. A sample that
  // several publishers may have sent gets none. (A subscription for listeners may exist before the
  // publisher. Its samples come again on the next subscription and may be sent twice; the mirror
  // recognizes them.)
  void number(MessageTaken& taken) const;
  // Was this transient-local sample, which has its number, not forwarded before? A sample without a
  // number is always new.
  [[nodiscard]] static bool is_new(Origin& origin, const MessageTaken& taken);
  // Had the publisher kept this new sample, which may be older than the subscription, for a late
  // subscriber? Then no more than `depth` of its samples came before.
  [[nodiscard]] static bool was_kept(Origin& origin, std::uint64_t depth);
  [[nodiscard]] const Origin& at(const Gid& gid) const { return origins_.at(gid); }
  [[nodiscard]] bool empty() const { return origins_.empty(); }
  [[nodiscard]] std::size_t size() const { return origins_.size(); }
  [[nodiscard]] auto begin() const { return origins_.begin(); }
  [[nodiscard]] auto end() const { return origins_.end(); }

 private:
  TopicTimers timers_;
  std::map<Gid, Origin> origins_;         // in an order that does not depend on the library
  std::map<std::uint64_t, Gid> changes_;  // the last change of each origin
  std::uint64_t last_change_ = 0;
  std::uint32_t last_ = 0;
  std::uint64_t turns_ = 0;  // of samples whose publisher is not reported
};

}  // namespace connect_bridge
