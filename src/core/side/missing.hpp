// Says without being asked what somebody here wants and does not get, and why.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/pace.hpp"
#include "core/base/timers.hpp"
#include "core/side/missing_names.hpp"

namespace connect_bridge {

// Looks at each link a while after something has changed, and from time to time while somebody here
// wants something; asks the peer where only that knows why; and keeps what it found for the status.
// What has not lasted for some seconds is not said: names come one after the other when a link
// opens. The log has one line for all that rules and types keep out, again when that changes.
// Single-threaded.
class Missing {
 public:
  explicit Missing(const SideView& side) : side_(side) {}

  // The graph, rules, or what a peer accepts, offers or listens to, may have changed.
  void on_change(const Now& now);
  void on_link_open(const Link& link, const Now& now);
  void on_link_lost(LinkId link) { of_links_.erase(link); }
  // The peer's rules have changed, perhaps: what it answered before may not be so any longer.
  void on_peer_rules(const Link& link, const Now& now);
  // The peer asks: answers. An error ends the connection: it asks too often.
  Result<Nothing> on_ask(Link& link, const Ask& ask, const Now& now);
  // An error ends the connection: nothing was asked, or something else.
  Result<Nothing> on_answer(Link& link, const Answered& answer, const Now& now);
  // The link that is to be looked at now; nullopt: none.
  std::optional<LinkId> take_due(const Now& now);
  // Looks at an open link. `wishes`: those that no link brings; of `picture` all but the answers.
  void look(Link& link, const std::vector<Wish>& wishes, LinkPicture picture, const Now& now);
  [[nodiscard]] std::optional<TimePoint> deadline() const { return timers_.deadline(); }
  void add_status(const Link& link, LinkStatus& status) const;

 private:
  struct OfLink {
    Pace asked{16, std::chrono::seconds(1)};  // by the peer
    TimePoint looked_at{};
    Timers<LinkId>::Timer looks;
    // The names that the last look found missing, each with the time since when.
    std::vector<std::pair<MissingName, TimePoint>> found;
    std::size_t further = 0;
    Answers answers;
    std::vector<Wish> under_way;  // the question that has no answer yet
    Wish asked_last;
    TimePoint asks_again{};  // about what was answered
    std::string logged;      // the last line of the log
    TimePoint tells_at{};
  };

  void ask(Link& link, OfLink& of_link, const std::vector<Wish>& wishes);
  void tell(const Link& link, OfLink& of_link, const Now& now) const;
  // How often a link is looked at at the most: all together cost the same, however many there are.
  [[nodiscard]] Duration looks_period() const;
  void look_at(LinkId link, OfLink& of_link, TimePoint at);

  const SideView side_;
  Timers<LinkId> timers_;
  std::map<LinkId, OfLink> of_links_;
};

}  // namespace connect_bridge
