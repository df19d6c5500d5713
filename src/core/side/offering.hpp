// Gives links the offers that they have not got yet, some in each step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "core/base/course.hpp"
#include "core/base/turns.hpp"
#include "core/graph/side_view.hpp"
#include "core/link/link.hpp"
#include "core/services/local_services.hpp"
#include "core/topics/local_topics.hpp"

namespace connect_bridge {

// A node that starts may bring a thousand names, each of which is to be offered to a hundred links.
// So many are offered in a step (GraphOptions::offers_at_once), identities take turns, and links
// within one. A link gets all that its peer may have when a list of `accepts` or rules are new,
// then the news. Topics come before services, and `complete` comes with the last offer of the first
// round. Single-threaded; owned by the side.
class Offering {
 public:
  explicit Offering(const SideView& side) : side_(side) {}

  // A step of the side begins.
  void begin_step() { left_ = side_.graph_options.offers_at_once * LinkOffer::kLooks; }
  // All that the peer may have and was not offered is due. The link is open, and has a list.
  void begin(Link& link);
  // The connection is lost.
  void forget(LinkId link);
  // Offers what is due, as much as is left for this step.
  void go_on(LocalTopics& topics, LocalServices& services, const Now& now) {
    go_on(false, topics, services, now);
  }
  // The same in a step that is for this: each identity pays for its links.
  void on_time(LocalTopics& topics, LocalServices& services, const Now& now) {
    if (goes_on_at_ && *goes_on_at_ <= now.steady) go_on(true, topics, services, now);
  }
  [[nodiscard]] std::optional<TimePoint> deadline() const { return goes_on_at_; }

 private:
  struct OfLink {
    explicit OfLink(Link& of) : link(&of) {}

    Link* link;
    Course all{};            // through all that there is
    std::uint64_t seen = 0;  // the news that it has got
    bool waits = false;      // for its turn
    bool full = false;       // something found no place on the link
  };
  using Name = std::pair<InterfaceKind, std::pair<std::string, std::string>>;

  void note_news(std::set<TopicKey> topics, std::set<ServiceKey> services);
  void restart(OfLink& of);
  void wait(OfLink& of);
  void go_on(bool pays, LocalTopics& topics, LocalServices& services, const Now& now);
  // True: nothing is due at the link any more.
  [[nodiscard]] bool offer_to(OfLink& of, LocalTopics& topics, LocalServices& services,
                              const Now& now);
  void forget_old_news();

  const SideView& side_;
  std::map<LinkId, OfLink> links_;
  TurnsOfGroups<std::uint64_t, LinkId, LinkId> turns_;  // accounts, their links
  // Names that may be due at every link, each once, in the order in which they came.
  std::map<Name, std::uint64_t> numbers_;
  std::map<std::uint64_t, std::map<Name, std::uint64_t>::iterator> news_;
  std::uint64_t last_ = 0;
  std::size_t left_ = 0;  // of what this step may do; a look takes 1
  std::optional<TimePoint> goes_on_at_;
};

}  // namespace connect_bridge
