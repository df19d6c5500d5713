// Samples of a topic that a peer has been offered and has not answered for yet.
#pragma once

#include <deque>
#include <map>
#include <set>

#include "core/jobs/encoder.hpp"
#include "core/topics/backlogs.hpp"
#include "core/topics/export_context.hpp"
#include "core/topics/topic_offer.hpp"

namespace connect_bridge {

// A peer that listens will demand the topic; what a new publisher says first is taken before the
// offer has crossed and the demand has come back. It is kept so long: for each link that listens
// the newest samples, for two seconds after the first at most. Single-threaded.
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
  // The link's offer has ended, or is made anew.
  void forget(LinkId link);
  void clear();

  [[nodiscard]] bool empty() const { return waiting_.empty(); }

 private:
  struct Waiting {
    std::deque<OutSample> samples;
    Budget::Hold bytes;
    ExportTimers::Timer until;
  };
  // Whether the peer listens and has not had the time to demand what it was offered.
  [[nodiscard]] bool is_awaited(const TopicOffer& offer, LinkId link) const;
  void keep(TopicOffer& offer, LinkId link, const OutSample& sample, const Now& now);

  ExportContext& context_;
  ExportedTopic& topic_;
  Offers& offers_;
  const Backlogs& backlogs_;
  std::map<LinkId, Waiting> waiting_;
  std::set<LinkId> over_;  // they have answered, or their time is over
};

}  // namespace connect_bridge
