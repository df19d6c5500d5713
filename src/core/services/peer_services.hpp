// The peers' services that exist here.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>

#include "core/base/timers.hpp"
#include "core/graph/side_view.hpp"
#include "core/link/link.hpp"
#include "core/services/calls.hpp"
#include "core/services/options.hpp"
#include "core/services/service_mirror.hpp"

namespace connect_bridge {

// Finds or creates the object that an input concerns; ServiceMirror, PeerService and MadeCall
// handle it, and share its members. Links dispatch messages of channels. Single-threaded; owned by
// the side.
class PeerServices final : public SideView {
 public:
  PeerServices(const SideView& side, const ServiceOptions& of_services, const std::string& node)
      : SideView(side), options(of_services), own_node(node) {}
  PeerServices(const PeerServices&) = delete;
  PeerServices& operator=(const PeerServices&) = delete;

  // Takes an offer. The caller has checked that the channel number is unused, and expects data on
  // it.
  void on_offer(Link& link, const ChannelOffer& offer, const Now& now);
  // The first round of offers is over: ends the services that the link has not offered again.
  void forget_orphans(LinkId link, const Now& now);

  // The connection is lost: mirrors and their calls wait for the link's return. Some services in
  // each step. True: all.
  [[nodiscard]] bool on_link_lost(LinkId link, LinkEnd& end, const Now& now);
  // The link is declared dead: its mirrors and their calls end, except requests for results of a
  // link that may return. Some services in each step. True: all.
  [[nodiscard]] bool on_link_dead(LinkId link, LinkEnd& end, const Now& now);
  // Such requests are kept for the link.
  [[nodiscard]] bool keeps(LinkId link) const;
  // The dead link will not return: they end.
  void on_link_forgotten(LinkId link, const Now& now);
  // Servers here changed.
  void on_graph(const Now& now, const GraphDifference& difference = {});
  void on_claims(const Now& now);  // what other bridges mirror changed
  // Our own claims were not fresh: all mirrors end, and nothing is claimed before the claims that
  // were missed have arrived.
  void on_lapse(const Now& now);
  void on_policy(const Now& now);

  // The action (local name) whose goals arrive at this mirror; null: none.
  [[nodiscard]] const std::string* goals_of(ServiceMirrorId mirror) const;
  void on_request(RequestTaken& request, const Now& now);
  void on_callers_gone(const CallersGone& gone, const Now& now);
  void on_mirror_failed(const ServiceMirrorFailed& failed, const Now& now);
  void on_type_differs(const ServiceTypeDiffers& differs, const Now& now);
  void on_time(const Now& now);

  // Adds the services that are mirrored here to our claim.
  void add_mirrored(Claim& claim) const;

  [[nodiscard]] std::optional<TimePoint> deadline() const {
    return earliest(timers.deadline(), looks.deadline());
  }
  // A service of some peer is mirrored here.
  [[nodiscard]] bool has_mirror(const ServiceKey& key) const;
  void add_status(const Link& link, LinkStatus& status) const;
  void add_channels(const Link& link, std::vector<ChannelFacts>& channels) const;
  [[nodiscard]] std::uint64_t memory_bytes() const { return bytes_of(loads); }
  // Number of updates of services: it measures the work done here.
  [[nodiscard]] std::uint64_t updated() const { return updated_; }

  // ---- for the services
  // Updates the service (ServiceMirror::update) and destroys it if nobody offers it any longer. The
  // other services of an action follow the link of its goals.
  void update(ServiceMirror& service, const Now& now);

  const ServiceOptions& options;
  const std::string& own_node;
  Timers<MadeCall*> timers{};
  Timers<ServiceMirror*> looks{};  // services without a mirror, at their next update
  CallLoads loads{};
  std::unordered_map<ServiceMirrorId, ServiceMirror*> by_mirror{};
  struct ByKey {
    using is_transparent = void;
    bool operator()(const ServiceMirror* a, const ServiceMirror* b) const {
      return a->key() < b->key();
    }
    bool operator()(const ServiceKey& a, const ServiceMirror* b) const { return a < b->key(); }
  };
  std::map<LinkId, std::set<ServiceMirror*, ByKey>> by_link{};  // that offers them
  std::optional<TimePoint> graph_since{};  // first graph; no mirror is made right after it
  std::map<ServiceKey, ServiceMirror> services{};
  std::uint64_t unanswered = 0;  // calls that ended without an answer

 private:
  std::uint64_t updated_ = 0;

  [[nodiscard]] ServiceMirror* find(ServiceMirrorId mirror) const;
  void update_named(const std::string& name, const Now& now);
  // Changes and updates each service, or those that the link offers, as many as `end` allows. A
  // service whose change is false needs no update. True: all.
  template <class Change>
  void update_each(const Change& change, const Now& now);
  template <class Change>
  bool update_of(LinkId link, LinkEnd& end, const Change& change, const Now& now);
};

}  // namespace connect_bridge
