// The services of the local graph that peers may call.
#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/services/real_service.hpp"
#include "core/services/serving.hpp"

namespace connect_bridge {

// A service is exported while it has a real server. Finds or creates the object that an input
// concerns; the handling is in these types (RealService, Attachment, ServedCall). Links dispatch
// what arrives on channels. Single-threaded; owned by the side.
class ServiceExports {
 public:
  ServiceExports(const SideView& side, const ServiceOptions& options, Random& random)
      : serving_{side, options, random} {}

  // Servers, or what other bridges claim, have changed.
  void on_graph(const Now& now);
  // Withdraws what the link may not have any longer, and applies the present rules to the rest.
  // Between hold() and go_on() no call begins: its right may not have been checked yet.
  void review(Link& link, const Now& now);
  void hold() { serving_.gate.hold(); }
  void go_on(const Now& now);
  // Adds the services that are to be offered to the link and are not yet.
  void collect_offers(Link& link, std::vector<ChannelOffer>& offers, const Now& now);
  // Which actions peers use since this was called last, or do not any longer.
  std::vector<ActionUse> take_action_uses() { return std::exchange(serving_.action_uses, {}); }

  // The connection is gone: calls go on, answers wait for the link's return.
  void on_link_lost(LinkId link);
  // The link is declared dead: its calls end.
  void on_link_dead(LinkId link, const Now& now);

  // What concerns a client here; it may be gone.
  template <class Input>
  void on(Input& input, const Now& now) {
    on(input.client, input, now);
  }
  void on(ServiceClientFailed& failed, const Now& now) { on(failed.id, failed, now); }
  void on_time(const Now& now);

  [[nodiscard]] std::optional<TimePoint> deadline() const;
  void add_status(const Link& link, LinkStatus& status) const;
  [[nodiscard]] std::uint64_t memory_bytes() const;

 private:
  template <class Input>
  void on(ServiceClientId client, Input& input, const Now& now) {
    const auto service = serving_.by_client.find(client);
    if (service != serving_.by_client.end()) service->second->on(input, now);
  }

  Serving serving_;
  std::map<ServiceKey, RealService> services_;
};

}  // namespace connect_bridge
