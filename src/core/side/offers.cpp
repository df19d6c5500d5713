#include "core/side/offers.hpp"

#include <string>
#include <utility>
#include <vector>

#include "core/offers/export_right.hpp"
#include "core/offers/import_right.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {

namespace {

// Logs that a type cannot be taken here. `part` has local names; for an action it is the goal part,
// whose rights are those of every part.
void log_lack(const Link& link, const SideView& side, const std::string& shown, Interface part,
              const TypeLack& lack) {
  const auto wire_name = link.names.to_wire(part.name);
  if (!wire_name) return;
  const std::string type(part.action_type.empty() ? part.type : part.action_type);
  part.name = *wire_name;
  if (export_right(side, link, part).answer != ExportRight::Answer::kYes) return;
  if (side.outputs.logged().first("type_lacking " + type))
    side.outputs.log(LogLevel::kWarn, "cannot export " + shown + ": " + lack.reason);
}

// An action is reported as a whole, under its own name and type.
void log_lacks(const Link& link, const SideView& side) {
  for (const auto& [key, topic] : side.graph.topics())
    if (topic.lack && !topic.publishers.empty() && !has_action_token(key.first))
      log_lack(link, side, key.first, {InterfaceKind::kTopic, key.first, key.second}, *topic.lack);
  for (const auto& [key, service] : side.graph.services())
    if (service.lack && !has_action_token(key.first) &&
        !side.claims.serves(service_gid(key.first)))  // another bridge serves it
      log_lack(link, side, key.first, {InterfaceKind::kService, key.first, key.second},
               *service.lack);
  for (const auto& [name, action] : side.actions.lacked()) {
    const std::string goals = name_of_part(name, ActionPart::kSendGoal);
    const std::string type = type_of_part(action.type, ActionPart::kSendGoal);
    log_lack(link, side, "the action " + name, {InterfaceKind::kService, goals, type, action.type},
             action.lack);
  }
}

}  // namespace

void offer_to(Link& link, const SideView& side, LocalTopics& topics, LocalServices& services,
              const Now& now) {
  if (!link.open() || !link.accepts) return;
  log_lacks(link, side);
  std::vector<ChannelOffer> offers;
  topics.collect_offers(link, offers, now);
  services.collect_offers(link, offers, now);
  if (!link.may_offer())
    side.outputs.log_once(link.account->logged, LogLevel::kWarn,
                          "not all interfaces of this side are offered to " + link.peer().node +
                              ": no more than " + std::to_string(Link::kOfferedMax) + " at a time");
  // Not too early: after `complete` the peer forgets channels that were not offered again
  // (docs/protocol.md section 7, rule 9).
  const bool completes = link.accepts.take_completion();
  if (offers.empty() && !completes) return;
  auto texts = encode_offers(offers, completes);
  for (std::size_t i = 0; i < texts.size(); ++i)
    link.send(std::move(texts[i]), completes && i + 1 == texts.size());
  // Their other origins come in texts of their own, behind the offer.
  for (const auto& offer : offers)
    if (offer.origins.size() > kAddedMax) link.sending().follow_texts(offer.channel);
}

Result<Nothing> take_offer(Link& link, const Offer& offer, std::uint32_t channels_max,
                           PeerTopics& topics, PeerServices& services, const Now& now) {
  for (const auto& channel : offer.channels) {
    if (!channel.channel || link.expects(channel.channel))
      return Error{CloseCode::kIllegal, "a channel number was offered twice"};
    if (link.offered() >= channels_max)
      return Error{CloseCode::kTooLarge, "more channels offered than this side accepts"};
    // Before an owner judges the channel: a declined channel stays offered, counts for the limit,
    // and may be withdrawn later.
    link.expect_offered(channel.channel, channel.kind);
    if (link.account->channels.used() > Account::kChannelsMax) {
      decline(services, link, channel, "limit", "its identity offers too many channels");
    } else if (channel.kind == InterfaceKind::kService) {
      services.on_offer(link, channel, now);
    } else {
      topics.on_offer(link, channel, now);
    }
  }
  return Nothing{};
}

}  // namespace connect_bridge
