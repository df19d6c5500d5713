// Gives links the offers, and the origins of topics, that they have not got yet, some in each step.
#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "core/graph/side_view.hpp"
#include "core/link/link_news.hpp"
#include "core/services/local_services.hpp"
#include "core/topics/local_topics.hpp"

namespace connect_bridge {

// So many are offered in a step (GraphOptions::offers_at_once); origins that come to a topic that
// is offered count as well. A link gets all that its peer may have when a list of `accepts` or
// rules are new, then the news (LinkNews). Topics come before services, and `complete` comes with
// the last offer of the first round. Single-threaded; owned by the side.
class Offering {
 public:
  explicit Offering(const SideView& side) : side_(side) {}

  // A step of the side begins.
  void begin_step() { left_ = side_.graph_options.offers_at_once * LinkOffer::kLooks; }
  // All that the peer may have and was not offered is due. The link is open, and has a list.
  void begin(Link& link) { news_.begin(link); }
  // The connection is lost.
  void forget(LinkId link) { news_.forget(link); }
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
  using Name = std::pair<InterfaceKind, std::pair<std::string, std::string>>;
  using OfLink = LinkNews<Name>::OfLink;

  void note_news(const std::set<TopicKey>& topics, const std::set<ServiceKey>& services);
  void go_on(bool pays, LocalTopics& topics, LocalServices& services, const Now& now);
  // True: nothing is due at the link any more.
  [[nodiscard]] bool offer_to(OfLink& of, LocalTopics& topics, LocalServices& services,
                              const Now& now);

  const SideView& side_;
  LinkNews<Name> news_;
  std::size_t left_ = 0;  // of what this step may do; a look takes 1
  std::optional<TimePoint> goes_on_at_;
};

}  // namespace connect_bridge
