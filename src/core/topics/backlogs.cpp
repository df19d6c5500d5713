#include "core/topics/backlogs.hpp"

#include <algorithm>
#include <string>
#include <utility>

// The course of a break, for one topic and one link (docs/protocol.md section 8.10). When the
// connection is about to be lost, begin() takes messages that may not have arrived from the link's
// queue. Then add() keeps each new reliable sample. When the link is back and the topic is offered
// to it again, take_over() decides whether the offer continues (`resume`). The first demand
// decides: go_on() sends the messages that the peer does not have, or drops them. Without a demand
// in time end_overdue() drops them. A further loss before the demand only starts the time again
// (renew).
namespace connect_bridge {
namespace {

TopicStatus status_of(const TopicKey& key) {
  TopicStatus status;
  status.topic = key.first;
  status.type = key.second;
  status.exported = true;
  return status;
}

void keep(Backlog& backlog, const OutSample& sample) {
  // Raw: the connection that will carry the sample decides its compression.
  OutMessage message = TopicOffer::message_of(sample, Codec::kNone, sample.raw);
  message.resumes = true;
  if (backlog.keep() == Keep::kAll || sample.video != VideoPart::kNone) message.state.reset();
  backlog.add(std::move(message));
}

// The lost links of one identity share a bound.
LinkBacklog& backlog_of(ExportContext& context, Link& lost) {
  if (const auto own = context.kept.find(lost.id); own != context.kept.end()) return own->second;
  std::shared_ptr<BacklogBound> bound;
  for (const auto& [id, kept] : context.kept)
    if (kept.bound()->is_of(lost)) bound = kept.bound();
  if (!bound)
    bound = std::make_shared<BacklogBound>(lost.account, context.options.resume_bytes_max);
  return context.kept.try_emplace(lost.id, std::move(bound), lost.memory).first->second;
}

}  // namespace

bool Backlogs::hold(OriginId origin) const {
  return std::any_of(backlogs_.begin(), backlogs_.end(),
                     [&](const auto& entry) { return entry.second.holds(origin); });
}

bool Backlogs::want_volatile() const {
  return std::any_of(backlogs_.begin(), backlogs_.end(), [](const auto& entry) {
    return entry.second.treatment().qos.durability == Durability::kVolatile;
  });
}

ExportTimers::Timer Backlogs::timer_for(const Link& link, const Now& now) {
  return timers_.set(link.life.kept_until(now));
}

std::size_t Backlogs::begin(TopicOffer& offer, LinkId link, const std::vector<OutSample>& encoding,
                            const Now& now) {
  Link& lost = offer.link();
  auto unarrived = offer.take_unarrived();
  auto options = offer.backlog_options(unarrived.last_sequence);
  options.ends = timer_for(lost, now);
  LinkBacklog& all = backlog_of(context_, lost);
  Backlog& backlog = backlogs_.try_emplace(link, all, lost, std::move(options)).first->second;
  // The order of the channel: messages in the link's queue are older than samples that a worker
  // still compresses.
  const std::size_t kept = unarrived.messages.size();
  backlog.begin(std::move(unarrived.messages));
  for (const auto& sample : encoding)
    sample.reliable ? keep(backlog, sample) : offer.lose(sample, DropReason::kLinkLost);
  return kept + encoding.size();
}

void Backlogs::renew(LinkId link, const Now& now) {
  Backlog& backlog = backlogs_.at(link);
  backlog.end_at(timer_for(backlog.link(), now));
}

void Backlogs::add(const OutSample& sample, const Now& now) {
  for (auto& [link, backlog] : backlogs_)
    if (backlog.admit(sample, now)) keep(backlog, sample);
}

void Backlogs::miss() {
  for (auto& [link, backlog] : backlogs_) backlog.drop(DropReason::kResumeBound);
}

// The backlog goes on only if the topic is still offered with the same treatment and type. The
// peer's demand and the rules of both sides were for these.
bool Backlogs::take_over(TopicOffer& offer, LinkId link, bool opened, const Now& now) {
  const auto backlog = backlogs_.find(link);
  if (backlog == backlogs_.end()) return false;
  if (opened && offer.may_take_place_of(backlog->second)) return true;
  remove(backlog, DropReason::kWithdrawn, now);
  return false;
}

// The first demand on the new connection decides. Messages up to `after` have arrived: they count
// as sent, even without an acknowledgement, and the rest is sent. Without `after` the peer does not
// know where it was: sending could repeat messages, so the backlog is dropped.
bool Backlogs::go_on(TopicOffer& offer, LinkId link, const ChannelDemand& demand, const Now& now) {
  const auto at = backlogs_.find(link);
  if (at == backlogs_.end()) return false;
  Backlog& backlog = at->second;
  const bool goes_on = offer.resumes() && demand.after;
  if (goes_on) {
    TopicStatus arrived = status_of(what_->key);  // these arrived, but were counted nowhere yet
    arrived.messages = backlog.size();
    auto messages = backlog.take(*demand.after);
    arrived.messages -= messages.size();
    offer.link().keep_counts({std::move(arrived)});
    offer.go_on({std::move(messages), backlog.last_sequence()}, now);
  }
  remove(at, DropReason::kNoDemand, now);
  return goes_on;
}

bool Backlogs::may_stay(LinkId link) const {
  const auto at = backlogs_.find(link);
  if (at == backlogs_.end()) return true;
  const auto right = export_right(context_, at->second.link(), *what_);
  return right.is_allowed_here() && may_follow(at->second.treatment(), right.decision.treatment);
}

bool Backlogs::end(LinkId link, DropReason reason, const Now& now) {
  const auto backlog = backlogs_.find(link);
  if (backlog == backlogs_.end()) return false;
  remove(backlog, reason, now);
  return true;
}

bool Backlogs::end_overdue(const Now& now) {
  for (auto it = backlogs_.begin(); it != backlogs_.end();) {
    const auto backlog = it++;
    if (backlog->second.ends_at() > now.steady) continue;  // mutant: kept_time
    remove(backlog, DropReason::kResumeBound, now);
  }
  const bool any = bool(ended_);
  ended_.cancel();
  return any;
}

void Backlogs::remove(std::map<LinkId, Backlog>::iterator backlog, DropReason reason,
                      const Now& now) {
  backlog->second.clear(reason, context_.dropped, now);
  TopicStatus counts = status_of(what_->key);
  counts.dropped = backlog->second.dropped();
  Link& link = backlog->second.link();
  link.keep_counts({std::move(counts)});
  backlogs_.erase(backlog);
  // The topic or its subscription may be needed no longer, but nothing may destroy them while the
  // topic works here. The topic's next deadline, at once, does that.
  ended_ = timers_.set(now.steady);
  // One log line for all topics of the link, when their last backlog has ended.
  const auto all = context_.kept.find(link.id);
  if (!all->second.empty()) return;
  const auto resumed = all->second.resumed();
  const auto lost = all->second.lost();
  context_.kept.erase(all);
  if (resumed + lost == 0) return;
  // A peer that connects and disconnects repeatedly would cause a line each time.
  if (const auto count = link.account->lines.count(now))
    context_.outputs.log(lost > 0 ? LogLevel::kWarn : LogLevel::kInfo,
                         "after the break of the link with " + link.label() + " " +
                             std::to_string(resumed) + " messages come late, " +
                             std::to_string(lost) + " are lost" + left_out(*count));
}

void Backlogs::add_status(LinkId link, LinkStatus& status) const {
  const auto backlog = backlogs_.find(link);
  if (backlog == backlogs_.end()) return;
  TopicStatus own = status_of(what_->key);
  const auto is_own = [&](const TopicStatus& s) {
    return s.exported && s.topic == own.topic && s.type == own.type;
  };
  auto shown = std::find_if(status.topics.begin(), status.topics.end(), is_own);
  if (shown == status.topics.end()) shown = status.topics.insert(shown, std::move(own));
  shown->queued += backlog->second.size();
  shown->kept = true;
  for (std::size_t i = 0; i < kDropReasons; ++i)
    shown->dropped.by_reason[i] += backlog->second.dropped().by_reason[i];
}

}  // namespace connect_bridge
