#include "core/side/offering.hpp"

#include <algorithm>
#include <string>
#include <vector>

namespace connect_bridge {

void Offering::begin(Link& link) {
  restart(links_.try_emplace(link.id, link).first->second);
}

// News that it looks at twice cost a look.
void Offering::restart(OfLink& of) {
  of.all = {};
  of.seen = last_;
  of.full = false;
  wait(of);
}

void Offering::forget(LinkId link) {
  if (links_.erase(link) == 0) return;
  turns_.erase_if([&](LinkId waiting) { return waiting == link; });
  forget_old_news();
}

void Offering::wait(OfLink& of) {
  if (!std::exchange(of.waits, true))
    turns_.add(of.link->account->number, of.link->id, of.link->id);
}

void Offering::note_news(std::set<TopicKey> topics, std::set<ServiceKey> services) {
  const std::uint64_t before = last_;
  const auto note = [&](InterfaceKind kind, const auto& keys) {
    for (const auto& key : keys) {
      const auto [at, is_new] = numbers_.try_emplace({kind, key}, 0);
      if (!is_new) news_.erase(at->second);
      at->second = ++last_;
      news_.emplace(last_, at);
    }
  };
  note(InterfaceKind::kTopic, topics);
  note(InterfaceKind::kService, services);
  if (last_ == before) return;
  for (auto& [id, of] : links_) wait(of);
}

void Offering::forget_old_news() {
  std::uint64_t seen = last_;
  for (const auto& [id, of] : links_) seen = std::min(seen, of.seen);
  while (!news_.empty() && news_.begin()->first <= seen) {
    numbers_.erase(news_.begin()->second);
    news_.erase(news_.begin());
  }
}

void Offering::go_on(bool pays, LocalTopics& topics, LocalServices& services, const Now& now) {
  note_news(topics.take_news(), services.take_news());
  for (auto& [id, of] : links_)
    if (of.full && of.link->may_offer()) restart(of);
  while (left_ > 0) {
    const auto next = turns_.take();
    if (!next) break;
    OfLink& of = links_.at(*next);
    of.waits = false;
    const Outputs::Paying paying(side_.outputs,
                                 pays ? of.link->account->time : side_.outputs.payer());
    if (!offer_to(of, topics, services, now)) wait(of);
  }
  goes_on_at_.reset();
  if (!turns_.empty()) goes_on_at_ = now.steady;
  forget_old_news();
}

bool Offering::offer_to(OfLink& of, LocalTopics& topics, LocalServices& services, const Now& now) {
  Link& link = *of.link;
  if (!link.open()) return true;  // its end follows
  std::vector<ChannelOffer> offers;
  Course& course = of.all;
  course.left = left_;
  const bool over = course.part(0, [&] { return topics.offer_all(link, course, offers, now); }) &&
                    course.part(1, [&] { return services.offer_all(link, course, offers, now); });
  auto next = news_.upper_bound(of.seen);
  for (; over && next != news_.end() && course.take(); ++next) {
    of.seen = next->first;
    const auto& [kind, key] = next->second->first;
    if (kind == InterfaceKind::kTopic)
      topics.offer_one(key, link, course, offers, now);
    else
      services.offer_one(key, link, course, offers, now);
  }
  left_ = course.left;
  if (!link.may_offer()) {
    of.full = true;
    side_.outputs.log_once(link.account->logged, LogLevel::kWarn,
                           "not all interfaces of this side are offered to " + link.peer().node +
                               ": no more than " + std::to_string(Link::kOfferedMax) +
                               " at a time");
  }
  // Not too early: after `complete` the peer forgets channels that were not offered again
  // (docs/protocol.md section 7, rule 9).
  send_offers(link, offers, over && link.accepts.take_completion());  // mutant: complete_is_last
  return over && next == news_.end();
}

}  // namespace connect_bridge
