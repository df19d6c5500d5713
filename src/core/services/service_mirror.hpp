// The mirror of a service that peers offer.
// One unit: each update decides together about its feeder, its claim and its endpoint.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "core/base/budget.hpp"
#include "core/base/timers.hpp"
#include "core/graph/claiming.hpp"
#include "core/policy/policy.hpp"
#include "core/services/peer_service.hpp"

namespace connect_bridge {

class PeerServices;

// A local service server, fed by one of the links that offer the service; the others stand by. The
// state of its calls lives as long as the mirror.
//
// Conditions for a mirror. Two servers of one name would both execute each call, and a mirror of a
// service that exists here would make a loop. So there is no mirror while a real server of the name
// is here, or another bridge claims the name. There is none either while the peer is a bridge in
// this same graph. The service is claimed when its feeder is asked to attach, and the mirror is
// made when others' claims would have arrived (Claiming). The mirror stays while its link is lost
// and not yet dead, so that callers do not notice a short loss. A mirror whose callers wait for
// results of goals stays longer, until the dead link is forgotten.
//
// All services of one action are fed by the link of its goals, or not at all. If several robots
// offer an action of one name, a cancel that goes to another robot stops nothing.
//
// Owned by PeerServices.
class ServiceMirror final : private Appearing::Waiting {
 public:
  ServiceMirror(ServiceKey key, PeerServices& imports);
  ServiceMirror(const ServiceMirror&) = delete;
  ServiceMirror& operator=(const ServiceMirror&) = delete;

  // Brings the mirror into the state that follows from all present knowledge. False: nobody offers
  // the service, and the caller destroys this object.
  [[nodiscard]] bool update(const Now& now);
  // Claims of other bridges concern the service otherwise than at the last call of this.
  [[nodiscard]] bool claims_differ();

  // ---- links; the caller updates the mirror afterwards
  // False: the link offers the service already.
  [[nodiscard]] bool on_offer(Link& link, const ChannelOffer& offer, Decision decision,
                              const Now& now);
  [[nodiscard]] const std::map<LinkId, PeerService>& feeds() const { return peer_services_; }
  // Asks the rules again; a peer service that they no longer allow ends.
  void on_policy(const Now& now);
  // The connection is lost. True if the link has a peer service.
  [[nodiscard]] bool on_link_lost(LinkId link);
  // The link is dead: its peer service is destroyed, unless it keeps requests for results.
  void on_link_dead(LinkId link, const Now& now);
  // Its peer service keeps requests for results while the link is dead.
  [[nodiscard]] bool keeps_results(LinkId link) const;
  // Destroys the peer service of the link. `why`: for the line about its calls.
  void remove_feed(LinkId link, const char* why, const Now& now);
  // Detaches from the feeding link and ends the mirror. The next update begins both again, if it
  // may.
  void close(const char* why, const Now& now);

  // ---- the mirror
  void on_request(RequestTaken& request, const Now& now);
  void on_callers_gone(const CallersGone& gone);
  // The caller updates the mirror after these two.
  void on_mirror_failed(const ServiceMirrorFailed& failed, const Now& now);
  void on_type_differs(const ServiceTypeDiffers& differs, const Now& now);
  [[nodiscard]] ServiceMirrorId mirror() const { return mirror_; }
  // The service's id in claims.
  [[nodiscard]] const Gid& gid() const { return gid_; }
  // True if the service is claimed, for a mirror that exists or will exist.
  [[nodiscard]] bool is_claimed() const { return claiming_.holds(); }
  [[nodiscard]] const ServiceKey& key() const { return key_; }
  // The mirror's type is, as far as hashes show, the one with this hash.
  [[nodiscard]] bool fits(const std::string& type_hash) const {
    return any_definition_ || type_hash_.empty() || type_hash.empty() || type_hash_ == type_hash;
  }
  [[nodiscard]] bool gives_results() const { return gives_results_; }
  // The action (local name) whose goals arrive here; empty: this is not a service for goals.
  [[nodiscard]] const std::string& goals_of() const { return goals_of_; }
  // The link that feeds the mirror, or will; none: it follows goals of a link that does not offer
  // it.
  [[nodiscard]] LinkId feeder() const { return feeder_; }

  // No mirror is made, as a node of this graph serves it.
  [[nodiscard]] bool is_served_here() const;
  void add_status(const Link& link, LinkStatus& status) const;
  void add_channels(const Link& link, std::vector<ChannelFacts>& channels) const;

 private:
  // The answers of the claims to all that an update asks them.
  struct Claimed {
    bool bridges = false;       // other bridges are in the graph
    bool peer_is_here = false;  // the feeder's peer is one of them
    bool taken = false;
    bool taken_first = false;  // even if this side claims the service
    bool served = false;
    bool goals_taken = false;
    bool operator==(const Claimed&) const = default;
  };
  [[nodiscard]] Claimed claimed_by_others() const;
  [[nodiscard]] bool is_peer_here() const;
  [[nodiscard]] PeerService* feeding();
  // The link of its action's goals; none: it has no such action, or no link has the goals.
  [[nodiscard]] LinkId link_of_goals() const;
  [[nodiscard]] LinkId next_feeder() const;
  [[nodiscard]] bool may_exist(const PeerService& peer_service);
  // Another bridge has a server of this name, or may have one while it claims the name.
  [[nodiscard]] bool is_served_by_bridge() const;
  // True if the mirror could be made but for the claims of others. A claim without this would keep
  // out a bridge that can make one.
  [[nodiscard]] bool may_be_claimed(const PeerService& peer_service, const Now& now);
  // Claims the service. Returns the time when the mirror may be made, as other bridges may claim
  // it, too.
  TimePoint claim(const Now& now);
  void give_up_claim();
  // True if its identity may have one more mirror now; the mirror is then counted.
  [[nodiscard]] bool may_appear(const PeerService& peer_service, const Now& now);
  void appear(const Now& now) override;
  void look_again(TimePoint at);
  // Counts the wait once, however long it lasts.
  void note_waiting(const PeerService& peer_service) {
    if (!std::exchange(waits_, true)) peer_service.link().mirrors.note_wait();
  }
  void create_mirror(const PeerService& peer_service);
  void log_difference(const std::string& hash_here, bool used);
  void destroy_mirror(const char* why, const Now& now);
  void forget_mirror();
  void erase_feed(LinkId link);

  PeerServices& imports_;
  ServiceKey key_;
  bool gives_results_;
  std::string action_;  // its action (local name); empty: none
  std::string goals_of_;
  // Ids in claims: of the service, and of its action's goals. A hash for each look would cost more
  // than the rest of an update.
  Gid gid_;
  Gid gid_of_goals_;
  Claimed claimed_{};
  std::map<LinkId, PeerService> peer_services_;
  LinkId feeder_;  // the link that we attach to
  ServiceMirrorId mirror_;
  std::string type_hash_;        // hash of the mirror's type
  bool any_definition_ = false;  // the rules allowed any definition when the mirror was made
  bool differs_ = false;         // the mirror has another definition than the peer
  Budget::Hold place_;           // its place among the mirrors of the feeding link's identity
  ProxyNames::Hold proxy_node_;  // owns the server; null: our own node does
  Claiming claiming_;
  TimePoint attaches_until_{};          // the peer's deadline for its answer to `attach`
  Timers<ServiceMirror*>::Timer look_;  // without a mirror: the next try
  bool waits_ = false;                  // delayed, because its identity makes too many mirrors
  bool failed_ = false;                 // until the next offer
};

}  // namespace connect_bridge
