#include "core/side/offering.hpp"

#include <string>
#include <vector>

namespace connect_bridge {

void Offering::note_news(const std::set<TopicKey>& topics, const std::set<ServiceKey>& services) {
  std::vector<Name> names;
  for (const TopicKey& key : topics) names.emplace_back(InterfaceKind::kTopic, key);
  for (const ServiceKey& key : services) names.emplace_back(InterfaceKind::kService, key);
  news_.note(names);
}

void Offering::go_on(bool pays, LocalTopics& topics, LocalServices& services, const Now& now) {
  note_news(topics.take_news(), services.take_news());
  news_.again_if([](const OfLink& of) { return of.full && of.link->may_offer(); });
  news_.give_turns(left_, [&](OfLink& of) {
    const Outputs::Paying paying(side_.outputs,
                                 pays ? of.link->account->time : side_.outputs.payer());
    return offer_to(of, topics, services, now);
  });
  goes_on_at_.reset();
  if (news_.waits()) goes_on_at_ = now.steady;
}

bool Offering::offer_to(OfLink& of, LocalTopics& topics, LocalServices& services, const Now& now) {
  Link& link = *of.link;
  if (!link.open()) return true;  // its end follows
  std::vector<ChannelOffer> offers;
  Course& course = of.all;
  course.left = left_;
  const bool over = course.part(0, [&] { return topics.offer_all(link, course, offers, now); }) &&
                    course.part(1, [&] { return services.offer_all(link, course, offers, now); });
  const bool all = over && news_.each(of, course, [&](const Name& name) {
    const auto& [kind, key] = name;
    if (kind == InterfaceKind::kTopic)
      topics.offer_one(key, link, course, offers, now);
    else
      services.offer_one(key, link, course, offers, now);
  });
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
  return all;
}

}  // namespace connect_bridge
