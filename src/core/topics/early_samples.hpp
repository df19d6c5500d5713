// Samples of a topic that was offered to a peer and that the peer has not demanded yet.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <set>

#include "core/jobs/encoder.hpp"
#include "core/topics/backlogs.hpp"
#include "core/topics/export_context.hpp"
#include "core/topics/topic_offer.hpp"

namespace connect_bridge {

// A peer that listens will demand the topic, but a new publisher's first messages are taken before
// the offer has arrived and the demand has come back. Until then the newest samples are kept for
// each link that listens, for at most two seconds after the first; a link that listens up to a
// second later gets those of the others, too. Single-threaded.
class EarlySamples {
 public:
  using Offers = std::map<LinkId, TopicOffer>;

  // Belongs to `topic`. All outlive this.
  EarlySamples(ExportContext& context, ExportedTopic& topic, Offers& offers,
               const Backlogs& backlogs)
      : context_(context), topic_(topic), offers_(offers), backlogs_(backlogs) {}

  // A sample was taken.
  void add(const OutSample& sample, const Now& now);
  // The link has said whether it wants the topic. Returns what was kept for it.
  std::deque<OutSample> answer(LinkId link);
  // Drops what has waited too long.
  void on_time(const Now& now);
  // The weakest of what our rules require for the links that listen and may demand the topic still,
  // or that it is not offered to yet. One that declines it, or whose time is over, does not count.
  [[nodiscard]] QosOverride rules_of_awaited() const;
  // The link's offer has ended, or is made again.
  void forget(LinkId link);
  void clear();

  [[nodiscard]] bool empty() const { return waiting_.empty(); }

 private:
  struct Waiting {
    std::deque<OutSample> samples;
    TimePoint first{};  // when the oldest was taken, for whatever link
    Budget::Hold bytes;
    std::shared_ptr<Account> account;
    Budget::Hold of_account;
    ExportTimers::Timer until;
  };
  // Whether the peer listens and may not yet have had time to demand what it was offered.
  [[nodiscard]] bool is_awaited(const TopicOffer& offer, LinkId link) const;
  void join(TopicOffer& offer, LinkId link, const Now& now);
  void keep(TopicOffer& offer, LinkId link, const OutSample& sample, const Now& now);

  ExportContext& context_;
  ExportedTopic& topic_;
  Offers& offers_;
  const Backlogs& backlogs_;
  std::map<LinkId, Waiting> waiting_;
  std::set<LinkId> over_;  // links that have answered, or whose time is over
};

}  // namespace connect_bridge
