// A service of peers that exists here as a mirror.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "core/policy/policy.hpp"
#include "core/services/feed.hpp"
#include "core/services/mirroring.hpp"

namespace connect_bridge {

// One mirror (a local service server), fed by one of the links that offer the service; the others
// stand by. What is known of its calls lives as long as the mirror.
//
// When a mirror may exist. Two servers of one name would both execute each call, and a mirror of
// what is served here would call itself in a circle. So there is none while a real server of the
// name is here, while another bridge with a better claim mirrors it, or while the peer is a bridge
// in this same graph. Bridges that start at the same time see each other's claims only after a
// while: a service is claimed when its feed is asked to attach, and the mirror is made when the
// claim has had time to meet objections, and the local graph time to be discovered. It stays while
// its link is lost and not yet dead, so that callers do not see every short loss.
//
// Owned by the table of mirrored services.
class MirroredService {
 public:
  MirroredService(ServiceKey key, Mirroring& mirroring);
  MirroredService(const MirroredService&) = delete;
  MirroredService& operator=(const MirroredService&) = delete;

  // Does what follows from what is known now. False: nobody offers it, and it is to be destroyed.
  [[nodiscard]] bool update(const Now& now);

  // ---- links. The caller updates it afterwards
  // False: the link offers it already.
  [[nodiscard]] bool on_offer(Link& link, const ChannelOffer& offer, Decision decision);
  // Takes its decision from the rules anew; a feed that they do not allow any longer ends.
  void on_policy();
  void on_link_lost(LinkId link);
  // Whether the link fed it or stood by, and does no longer.
  [[nodiscard]] bool on_link_dead(LinkId link);
  // The link has not offered it again.
  [[nodiscard]] bool forget_orphan(LinkId link);
  // Updates itself, and may be gone then.
  void on_withdraw(LinkId link, const Now& now);

  // ---- the mirror
  void on_request(RequestTaken& request, const Now& now);
  void on_callers_gone(const CallersGone& gone);
  void on_mirror_failed(const ServiceMirrorFailed& failed);
  [[nodiscard]] ServiceMirrorId mirror() const { return mirror_; }
  // Claimed, for a mirror that there is or will be.
  [[nodiscard]] bool is_claimed() const { return mirror_at_.has_value(); }

  [[nodiscard]] const ServiceKey& key() const { return key_; }
  [[nodiscard]] bool gives_results() const { return gives_results_; }
  // The action (local name) whose goals come here, if there is one; else empty.
  [[nodiscard]] const std::string& goals_of() const { return goals_of_; }

  void add_status(const Link& link, LinkStatus& status) const;

 private:
  [[nodiscard]] Feed* feeding();
  [[nodiscard]] std::optional<Decision> permission(const Feed& feed) const;
  void take_over();
  [[nodiscard]] bool may_exist(const Feed& feed);
  void claim(const Now& now);
  void create_mirror(const Feed& feed);
  void destroy_mirror();
  // The attachment of the feeding link ends, and the mirror.
  void close();
  void remove_feed(LinkId link);

  Mirroring& mirroring_;
  ServiceKey key_;
  bool gives_results_;
  std::string goals_of_;
  std::map<LinkId, Feed> feeds_;
  LinkId feeder_;  // the one that is attached
  ServiceMirrorId mirror_;
  std::optional<TimePoint> mirror_at_;  // set while claimed: when objections have had their time
  bool failed_ = false;                 // until it is offered again
};

}  // namespace connect_bridge
