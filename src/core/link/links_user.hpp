// Notices about links, for the owners of channels on them.
#pragma once

#include "core/link/link.hpp"

namespace connect_bridge {

class LinksUser : public LinkUser {
 public:
  // A connection carries the link from now on.
  virtual void on_link_open(Link& link, const Now& now) = 0;
  // The link goes on, but the process at the other end is another one and remembers no calls.
  virtual void on_peer_replaced(Link& link, const Now& now) = 0;
  // The connection is about to go, and its channels with it. Mirrors and calls wait.
  virtual void on_link_lost(Link& link, const Now& now) = 0;
  // It was lost for dead_after, or left for good: its calls and mirrors end.
  virtual void on_link_dead(Link& link, const Now& now) = 0;
  // The link's identity has changed, and perhaps its rights.
  virtual void on_identity_changed(Link& link, const Now& now) = 0;
  // Whether something is kept for a dead link's return.
  [[nodiscard]] virtual bool resumes(const Link& link) const = 0;
  // A dead link will not return: what is kept for it goes.
  virtual void on_link_forgotten(Link& link, const Now& now) = 0;
  // The time for offers after a reconnect is over: the peer will not offer the rest again.
  virtual void on_offers_over(Link& link, const Now& now) = 0;

 protected:
  ~LinksUser() = default;
};

}  // namespace connect_bridge
