// What one topic keeps for links that are lost, until they go on or will not return.
#pragma once

#include <map>
#include <vector>

#include "core/jobs/encoder.hpp"
#include "core/topics/backlog.hpp"
#include "core/topics/export_context.hpp"
#include "core/topics/topic_offer.hpp"

namespace connect_bridge {

// Belongs to an exported topic. A link has a backlog from the loss of its connection to its demand
// on another one. Single-threaded.
class Backlogs {
 public:
  // All outlive this.
  Backlogs(ExportContext& context, ExportedTopic& topic) : context_(context), topic_(topic) {}

  [[nodiscard]] bool empty() const { return backlogs_.empty(); }
  [[nodiscard]] bool contains(LinkId link) const { return backlogs_.contains(link); }
  // Whether a message of this origin is kept.
  [[nodiscard]] bool hold(OriginId origin) const;
  // Whether something is kept still, so that the topic is to be subscribed.
  [[nodiscard]] bool want_samples() const;
  // Whether what is wanted must be volatile, by a rule.
  [[nodiscard]] bool want_volatile() const;

  // The connection of this offer is about to be lost: what may not have arrived is kept, and what
  // is published from now on. `encoding`: what is under way to be compressed for it.
  void begin(TopicOffer& offer, LinkId link, const std::vector<OutSample>& encoding,
             const Now& now);
  // The link is lost again before it went on: the time to keep begins anew.
  void renew(LinkId link, const Now& now);
  // A reliable sample was taken.
  void add(const OutSample& sample, const Now& now);
  // One of a reliable publisher was, but not reliably, because another reads the topic so: it
  // cannot be kept.
  void miss();
  // The link is back. Whether the offer, if it was opened, takes the place of the one before; else
  // nothing of that goes on.
  [[nodiscard]] bool take_over(TopicOffer& offer, LinkId link, bool opened);
  // The link demands the topic or does not any longer. Whether it goes on from here: then what was
  // kept is sent, else it is dropped.
  [[nodiscard]] bool go_on(TopicOffer& offer, LinkId link, const ChannelDemand& demand,
                           const Now& now);
  // Whether the rules here still say of the link what they said when its backlog was begun. Also
  // where there is none.
  [[nodiscard]] bool may_stay(LinkId link) const;
  // Nothing is kept for the link any more; what was is dropped. False: there was nothing.
  bool end(LinkId link, DropReason reason, const Now& now);
  // Ends those whose time is over. Whether there were any.
  bool end_overdue(const Now& now);

  void add_status(LinkId link, LinkStatus& status) const;

 private:
  [[nodiscard]] ExportTimers::Timer timer_for(const Link& link, const Now& now);
  // What is lost with it is counted with the link. The last of a link's topics tells the log.
  void remove(std::map<LinkId, Backlog>::iterator backlog, const Now& now);

  ExportContext& context_;
  ExportedTopic& topic_;
  std::map<LinkId, Backlog> backlogs_;
  ExportTimers::Timer ended_;  // the last one did: the topic may be over
};

}  // namespace connect_bridge
