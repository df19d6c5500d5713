// A service of peers that exists here as a mirror.
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

// One mirror (a local service server), fed by one of the links that offer the service; the others
// stand by. The state of its calls lives as long as the mirror.
//
// When a mirror may exist. Two servers of one name would both execute each call, and a mirror of a
// service that exists here would make a loop. So there is no mirror while a real server of the name
// is here, while another bridge claims it, or while the peer is a bridge in this same graph. It is
// claimed when its feed is asked to attach, and made when others' claims would have arrived
// (Claiming). It stays while its link is lost and not yet dead, so that callers do not notice a
// short loss.
//
// The services of one action are fed by the link that its goals go to, or not at all: where several
// robots offer an action of one name, a cancel that goes to another robot stops nothing.
//
// Owned by the table of mirrored services.
class ServiceMirror final : private Appearing::Waiting {
 public:
  ServiceMirror(ServiceKey key, PeerServices& imports);
  ServiceMirror(const ServiceMirror&) = delete;
  ServiceMirror& operator=(const ServiceMirror&) = delete;

  // Brings the mirror into the state that follows from all that is known now. False: nobody offers
  // the service, and this is to be destroyed.
  [[nodiscard]] bool update(const Now& now);

  // ---- links. The caller updates it afterwards
  // False: the link offers it already.
  [[nodiscard]] bool on_offer(Link& link, const ChannelOffer& offer, Decision decision);
  [[nodiscard]] const std::map<LinkId, PeerService>& feeds() const { return peer_services_; }
  // Asks the rules again; a feed that they do not allow any longer ends.
  void on_policy();
  // Whether the link has a feed.
  [[nodiscard]] bool on_link_lost(LinkId link);
  // Whether there was one.
  bool remove_feed(LinkId link);
  // The attachment of the feeding link ends, and the mirror. They begin again with an update, if
  // they may.
  void close();

  // ---- the mirror
  void on_request(RequestTaken& request, const Now& now);
  void on_callers_gone(const CallersGone& gone);
  // The caller updates it after these two.
  void on_mirror_failed(const ServiceMirrorFailed& failed);
  void on_type_differs(const ServiceTypeDiffers& differs);
  [[nodiscard]] ServiceMirrorId mirror() const { return mirror_; }
  // Whether it is claimed, for a mirror that exists or will exist.
  [[nodiscard]] bool is_claimed() const { return claiming_.holds(); }
  [[nodiscard]] const ServiceKey& key() const { return key_; }
  [[nodiscard]] bool gives_results() const { return gives_results_; }
  // The action (local name) whose goals arrive here; empty if this is not such a service.
  [[nodiscard]] const std::string& goals_of() const { return goals_of_; }
  // The link that feeds it, or is to; none: it follows goals that go to a link without a feed.
  [[nodiscard]] LinkId feeder() const { return feeder_; }

  void add_status(const Link& link, LinkStatus& status) const;

 private:
  [[nodiscard]] PeerService* feeding();
  // The link that the goals of its action go to; none: it is not such a service, or no link has
  // them.
  [[nodiscard]] LinkId link_of_goals() const;
  [[nodiscard]] LinkId next_feeder() const;
  [[nodiscard]] bool may_exist(const PeerService& peer_service);
  // Another bridge has a server of its name, or may have one as long as it claims it.
  [[nodiscard]] bool is_served_by_bridge() const;
  // Whether its mirror could be made, but for the claims of others: else it would keep out a bridge
  // that can make one.
  [[nodiscard]] bool may_be_claimed(const PeerService& peer_service, const Now& now);
  // When its mirror may be made, as other bridges may claim it; it is claimed as soon as it may.
  TimePoint claim(const Now& now);
  void give_up_claim();
  // Whether its identity may have one more mirror at this moment. It is counted then.
  [[nodiscard]] bool may_appear(const PeerService& peer_service, const Now& now);
  void appear(const Now& now) override;
  void look_again(TimePoint at);
  // It is counted once, however long it waits.
  void note_waiting(const PeerService& peer_service) {
    if (!std::exchange(waits_, true)) peer_service.link().mirrors.note_wait();
  }
  void create_mirror(const PeerService& peer_service);
  void log_difference(const std::string& hash_here, bool used);
  void destroy_mirror();
  void forget_mirror();

  PeerServices& imports_;
  ServiceKey key_;
  bool gives_results_;
  std::string action_;  // that it is a part of (local name); empty: of none
  std::string goals_of_;
  std::map<LinkId, PeerService> peer_services_;
  LinkId feeder_;  // the link that is attached
  ServiceMirrorId mirror_;
  std::string type_hash_;        // of the mirror
  bool any_definition_ = false;  // the rules allowed that when it was made
  bool differs_ = false;         // and it has another one than the peer
  Budget::Hold place_;  // among those of the feeding link's identity, while there is a mirror
  Claiming claiming_;
  TimePoint attaches_until_{};          // the peer is to have answered by then
  Timers<ServiceMirror*>::Timer look_;  // without a mirror: when one may be made, or waits again
  bool waits_ = false;                  // it is late because its identity makes too many
  bool failed_ = false;                 // until it is offered again
};

}  // namespace connect_bridge
