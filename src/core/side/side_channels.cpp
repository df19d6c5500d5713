// Channels of all kinds share their numbers and their rounds of offers: who gets which message.
#include "core/side/side_state.hpp"

namespace connect_bridge {
void Side::State::update_exports(const Now& now) {
  service_exports.on_graph(now);
  if (!actions.update(graph, claims)) return send_offers(now);
  service_exports.hold();
  for (auto& [id, link] : links)
    if (link.open() && link.accepts) recheck(link, now);
  service_exports.go_on(now);
}

void Side::State::hold_actions(const Now& now) {
  for (const auto& use : service_exports.take_action_uses())
    exports.hold_action(use.action, use.on, now);
}

void Side::State::send_offers(Link& link, const Now& now) {
  std::vector<ChannelOffer> offers;
  exports.collect_offers(link, offers);
  service_exports.collect_offers(link, offers, now);
  if (offers.empty() && link.offers_complete) return;
  for (auto& text : encode_offers(offers, !link.offers_complete)) link.send(std::move(text));
  link.offers_complete = true;
}

void Side::State::send_offers(const Now& now) {
  for (auto& [id, link] : links)
    if (link.open() && link.accepts) send_offers(link, now);
}

void Side::State::recheck(Link& link, const Now& now) {
  exports.recheck(link, now);
  service_exports.recheck(link, now);
  send_offers(link, now);
}

Result<Nothing> Side::State::on_offer(Link& link, const Offer& offer, const Now& now) {
  for (const auto& channel : offer.channels) {
    if (!channel.channel || link.connection->is_expected(channel.channel))
      return Error{CloseCode::kIllegal, "a channel number was offered twice"};
    if (link.offered >= options.channels_max)
      return Error{CloseCode::kTooLarge, "more channels offered than this side accepts"};
    link.expect_offered(channel.channel);
    if (channel.kind == InterfaceKind::kService) {
      service_imports.on_offer(link, channel, now);
    } else {
      imports.on_offer(link, channel, now);
    }
  }
  if (offer.complete) forget_orphans(link.id, now);
  return Nothing{};
}

Result<Nothing> Side::State::on_withdraw(Link& link, const Withdraw& withdraw, const Now& now) {
  for (const ChannelId number : withdraw.channels) {
    if (IncomingChannel* channel = link.incoming(number)) {
      const bool offered = link.is_offered(number);
      link.forget(number);
      channel->on_withdraw(now);
      if (!offered) continue;
    } else {
      if (service_exports.on_withdraw(link, number, now)) continue;  // of requests to us
      if (!imports.on_withdraw(link, number, now) &&
          !service_imports.on_withdraw(link, number, now))
        return Error{CloseCode::kUnknownChannel, "a channel that does not exist was withdrawn"};
      link.forget(number);
    }
    if (!link.withdrawals.take(now.steady))
      return Error{CloseCode::kTooLarge, "channels are offered and withdrawn too often"};
  }
  return Nothing{};
}

Result<Nothing> Side::State::on_attach(Link& link, const Attach& attach, const Now& now) {
  if (auto* channel = link.outgoing(attach.channel)) return channel->on_attach(attach, now);
  if (exports.is_offered(link.id, attach.channel) ||
      service_imports.sends_on(link.id, attach.channel))
    return Error{CloseCode::kIllegal, "attached to a channel that is no service"};
  return service_exports.on_attach(link, attach, now);
}

Result<Nothing> Side::State::on_message(Link& link, InMessage& message, const Now& now) {
  if (auto* channel = link.incoming(message.channel))
    return channel->on_message(std::move(message), now);
  if (auto result = imports.on_message(link, message, now)) return *std::move(result);
  if (auto result = service_imports.on_message(link, message)) return *std::move(result);
  if (auto result = service_exports.on_message(link, message, now)) return *std::move(result);
  return Error{CloseCode::kUnknownChannel, "a message for a channel that does not exist"};
}

void Side::State::forget_orphans(LinkId link, const Now& now) {
  imports.forget_orphans(link, now);
  service_imports.forget_orphans(link, now);
}

void Side::State::on_link_lost(Link& link, const Now& now) {
  exports.on_link_lost(link.id);
  imports.on_link_lost(link.id, now);
  service_exports.on_link_lost(link.id);
  service_imports.on_link_lost(link.id);
  link.forget_channels();
}

void Side::State::on_link_dead(LinkId link, const Now& now) {
  imports.on_link_dead(link, now);
  end_calls(link, now);
}

void Side::State::end_calls(LinkId link, const Now& now) {
  service_exports.on_link_dead(link, now);
  service_imports.on_link_dead(link, now);
}

}  // namespace connect_bridge
