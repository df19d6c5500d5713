// The services of the local graph that peers may call.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/base/course.hpp"
#include "core/base/random.hpp"
#include "core/base/timers.hpp"
#include "core/graph/side_view.hpp"
#include "core/services/calls.hpp"
#include "core/services/local_service.hpp"
#include "core/services/options.hpp"
#include "core/services/sent_goals.hpp"

namespace connect_bridge {

// A change of use: peers can send goals to this action from now on, or no longer.
struct ActionUse {
  std::string action;  // local name
  bool on = false;
};

// A service is exported while it has a real server. This table finds or creates the object that an
// input concerns; LocalService, ServiceOffer and ServedCall handle it, and share its members. Links
// dispatch messages of channels. Single-threaded; owned by the side.
class LocalServices final : public SideView {
 public:
  LocalServices(const SideView& side, const ServiceOptions& of_services, Random& random_numbers)
      : SideView(side), options(of_services), random(random_numbers) {}
  LocalServices(const LocalServices&) = delete;
  LocalServices& operator=(const LocalServices&) = delete;

  // Servers, or the claims of other bridges, have changed. The offers of a service whose server is
  // gone end, some in each step; no call begins any more.
  void on_graph(const Now& now);
  // Withdraws services that the link may not have any longer, and applies the present rules to the
  // rest. Between hold() and go_on() no call begins: its right may not have been checked yet.
  void review(Link& link, const Now& now);
  // The same for the services of one name.
  void review(Link& link, const std::string& name, const Now& now);
  void hold() { held = true; }
  void go_on(const Now& now);
  // The same functions as those of LocalTopics.
  [[nodiscard]] bool offer_all(Link& link, Course& course, std::vector<ChannelOffer>& offers,
                               const Now& now);
  void offer_one(const ServiceKey& key, Link& link, Course& course,
                 std::vector<ChannelOffer>& offers, const Now& now);
  std::set<ServiceKey> take_news() { return std::exchange(news, {}); }
  // Changes of action use since the last call.
  std::vector<ActionUse> take_action_uses() { return std::exchange(action_uses, {}); }

  // The connection is gone: calls go on, answers wait for the link's return. Its offers end, some
  // in each step. True: all have ended.
  void on_link_lost(LinkId link, const Now& now) { goals.on_link_lost(link, now.steady); }
  [[nodiscard]] bool end_offers(LinkId link, LinkEnd& end);
  // The link is declared dead: its calls end.
  void on_link_dead(const Link& link, const Now& now);

  void on_link_open(const Link& link) { goals.on_link_open(sender_of(link)); }

  // Inputs about a client here; the client may be gone.
  template <class Input>
  void on(Input& input, const Now& now) {
    on(input.client, input, now);
  }
  void on(ServiceClientFailed& failed, const Now& now) { on(failed.id, failed, now); }
  void on_time(const Now& now);

  [[nodiscard]] std::optional<TimePoint> deadline() const {
    return earliest(earliest(timers.deadline(), goals.deadline()), leaving_at_);
  }
  void add_status(const Link& link, LinkStatus& status) const;
  void add_channels(const Link& link, std::vector<ChannelFacts>& channels) const;
  [[nodiscard]] std::uint64_t memory_bytes() const { return bytes_of(loads); }

  // ---- for the services
  const ServiceOptions& options;
  Random& random;
  bool held = false;  // no call begins
  Timers<CallDue> timers{};
  CallLoads loads{};
  std::unordered_map<ServiceClientId, LocalService*> by_client{};
  std::vector<ActionUse> action_uses{};  // changes that were not taken yet
  SentGoals goals{};
  std::set<ServiceKey> news{};   // services that may be due at links that had no offer of them
  std::uint64_t unanswered = 0;  // calls that ended without an answer

 private:
  // Ends a goal whose sender is gone.
  void cancel(const SentGoal& goal);
  template <class Input>
  void on(ServiceClientId client, Input& input, const Now& now) {
    const auto service = by_client.find(client);
    if (service != by_client.end()) service->second->on(input, now);
  }

  // Ends services without a server, as far as one step may.
  void end_leaving(const Now& now);

  std::map<ServiceKey, LocalService> services_;
  std::set<ServiceKey> leaving_;         // of these: services whose server is gone
  std::optional<TimePoint> leaving_at_;  // when more of them end; none: there are none
};

}  // namespace connect_bridge
