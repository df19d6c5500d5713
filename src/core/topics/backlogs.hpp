// What one topic keeps for lost links, until they resume it or will not return.
#pragma once

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "core/jobs/encoder.hpp"
#include "core/topics/backlog.hpp"
#include "core/topics/export_context.hpp"
#include "core/topics/topic_offer.hpp"

namespace connect_bridge {

// Belongs to an exported topic. A link has a backlog from the loss of its connection until its
// demand on another one. Single-threaded.
class Backlogs {
 public:
  Backlogs(ExportContext& context, std::shared_ptr<const LocalInterface> what, TopicTimers timers)
      : context_(context), what_(std::move(what)), timers_(timers) {}

  // Else samples are to be kept, and the topic must stay subscribed.
  [[nodiscard]] bool empty() const { return backlogs_.empty(); }
  [[nodiscard]] bool contains(LinkId link) const { return backlogs_.contains(link); }
  // Whether a message of this origin is kept.
  [[nodiscard]] bool hold(OriginId origin) const;
  // Whether a rule requires the subscription to be volatile.
  [[nodiscard]] bool want_volatile() const;

  // The connection of this offer is about to be lost: keeps what may not have arrived, and what is
  // published from now on. `encoding`: samples that are being compressed for it.
  void begin(TopicOffer& offer, LinkId link, const std::vector<OutSample>& encoding,
             const Now& now);
  // The link is lost again before it was resumed: the time limit starts again.
  void renew(LinkId link, const Now& now);
  // A reliable sample was taken.
  void add(const OutSample& sample, const Now& now);
  // A sample of a reliable publisher was taken by a best-effort subscription, so it cannot be kept.
  void miss();
  // The link is back. Whether the offer, if it was opened, continues the previous one; if not, what
  // was kept is dropped.
  [[nodiscard]] bool take_over(TopicOffer& offer, LinkId link, bool opened, const Now& now);
  // The link demands the topic, or does not any longer. Whether it is resumed now: if so, what was
  // kept is sent, otherwise it is dropped.
  [[nodiscard]] bool go_on(TopicOffer& offer, LinkId link, const ChannelDemand& demand,
                           const Now& now);
  // Whether the rules here treat the topic for the link as when its backlog was begun. True also if
  // there is no backlog.
  [[nodiscard]] bool may_stay(LinkId link) const;
  // Drops what is kept for the link. False: nothing was kept.
  bool end(LinkId link, DropReason reason, const Now& now);
  // Ends the backlogs whose time is over. Whether any have ended since this was called last.
  bool end_overdue(const Now& now);

  void add_status(LinkId link, LinkStatus& status) const;

 private:
  [[nodiscard]] ExportTimers::Timer timer_for(const Link& link, const Now& now);
  // What is left of it is dropped for this reason, and counted at the link. The last backlog of a
  // link writes the log line.
  void remove(std::map<LinkId, Backlog>::iterator backlog, DropReason reason, const Now& now);

  ExportContext& context_;
  std::shared_ptr<const LocalInterface> what_;
  TopicTimers timers_;
  std::map<LinkId, Backlog> backlogs_;
  ExportTimers::Timer ended_;  // set when a backlog has ended: the topic looks what it wants now
};

}  // namespace connect_bridge
