#include "core/side/offers.hpp"

#include <string>
#include <utility>
#include <vector>

namespace connect_bridge {

void offer_to(Link& link, Exports& topics, ServiceExports& services, TypeLacks& lacks,
              Outputs& outputs, const Now& now) {
  if (!link.open() || !link.accepts) return;
  lacks.tell(link);
  std::vector<ChannelOffer> offers;
  topics.collect_offers(link, offers);
  services.collect_offers(link, offers, now);
  if (!link.may_offer())
    outputs.log_once(link.account->told, LogLevel::kWarn,
                     "not all interfaces of this side are offered to " + link.peer().node +
                         ": no more than " + std::to_string(Link::kOfferedMax) + " at a time");
  // Not too early: at `complete` the peer forgets what it had and was not offered again
  // (docs/protocol.md section 7, rule 9).
  const bool completes = link.accepts.take_completion();
  if (offers.empty() && !completes) return;
  for (auto& text : encode_offers(offers, completes)) link.send(std::move(text));
}

Result<Nothing> take_offer(Link& link, const Offer& offer, std::uint32_t channels_max,
                           Imports& topics, ServiceImports& services, TypeLacks& lacks,
                           const Now& now) {
  lacks.on_offer(link, offer);
  for (const auto& channel : offer.channels) {
    if (!channel.channel || link.expects(channel.channel))
      return Error{CloseCode::kIllegal, "a channel number was offered twice"};
    if (link.offered() >= channels_max)
      return Error{CloseCode::kTooLarge, "more channels offered than this side accepts"};
    // Before an owner judges it: a channel that is declined stays offered, counts for the limit,
    // and may be withdrawn later.
    link.expect_offered(channel.channel, channel.kind);
    if (channel.kind == InterfaceKind::kService) {
      services.on_offer(link, channel, now);
    } else {
      topics.on_offer(link, channel, now);
    }
  }
  return Nothing{};
}

}  // namespace connect_bridge
