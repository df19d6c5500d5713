// Messages that one topic keeps for lost links, until a link resumes them or will not return.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "core/jobs/encoder.hpp"
#include "core/topics/backlog.hpp"
#include "core/topics/export_context.hpp"
#include "core/topics/topic_offer.hpp"

namespace connect_bridge {

// Belongs to a local topic. A link has a backlog from the loss of its connection until its demand
// on another one. Single-threaded.
class Backlogs {
 public:
  Backlogs(ExportContext& context, std::shared_ptr<const LocalInterface> what, TopicTimers timers)
      : context_(context), what_(std::move(what)), timers_(timers) {}

  // No link waits to resume. If one does, samples are kept and the topic stays subscribed.
  [[nodiscard]] bool empty() const { return backlogs_.empty(); }
  [[nodiscard]] bool contains(LinkId link) const { return backlogs_.contains(link); }
  // Whether a message of this origin is kept.
  [[nodiscard]] bool hold(OriginId origin) const;
  // Whether a rule requires the subscription to be volatile.
  [[nodiscard]] bool want_volatile() const;

  // The connection of this offer is about to be lost. Keeps messages that may not have arrived, and
  // messages published from now on. `encoding`: samples that a worker compresses for the offer.
  // Returns how many messages it has kept.
  std::size_t begin(TopicOffer& offer, LinkId link, const std::vector<OutSample>& encoding,
                    const Now& now);
  // The link is lost again before it was resumed: the time limit starts again.
  void renew(LinkId link, const Now& now);
  // A reliable sample was taken.
  void add(const OutSample& sample, const Now& now);
  // A sample of a reliable publisher was taken by a best-effort subscription, so it cannot be kept.
  void miss();
  // The link is back: does the offer, if it was opened, continue the previous one? If not, the
  // backlog is dropped.
  [[nodiscard]] bool take_over(TopicOffer& offer, LinkId link, bool opened, const Now& now);
  // The link demands the topic, or does so no longer. True: the link resumes, and the backlog is
  // sent. False: the backlog is dropped.
  [[nodiscard]] bool go_on(TopicOffer& offer, LinkId link, const ChannelDemand& demand,
                           const Now& now);
  // Do our rules still treat the topic for this link as when its backlog began? True also without a
  // backlog.
  [[nodiscard]] bool may_stay(LinkId link) const;
  // Drops the link's backlog. False: there was none.
  bool end(LinkId link, DropReason reason, const Now& now);
  // Drops the backlogs whose time is over. True: a backlog has ended since the last call.
  bool end_overdue(const Now& now);

  void add_status(LinkId link, LinkStatus& status) const;

 private:
  [[nodiscard]] ExportTimers::Timer timer_for(const Link& link, const Now& now);
  // Drops the rest of the backlog for this reason, and counts it at the link. The last backlog of a
  // link writes the log line.
  void remove(std::map<LinkId, Backlog>::iterator backlog, DropReason reason, const Now& now);

  ExportContext& context_;
  std::shared_ptr<const LocalInterface> what_;
  TopicTimers timers_;
  std::map<LinkId, Backlog> backlogs_;
  ExportTimers::Timer ended_;  // set when a backlog has ended: the topic then checks what it needs
};

}  // namespace connect_bridge
