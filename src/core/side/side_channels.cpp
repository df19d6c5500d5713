// Channels of all kinds share their numbers and their rounds of offers: who gets which message.
#include <algorithm>

#include "core/side/side_state.hpp"

namespace connect_bridge {
namespace {

// What a peer offers and withdraws again costs this graph endpoints that come and go.
constexpr Duration kWithdrawalPeriod = std::chrono::milliseconds(5);
constexpr int kWithdrawalsAtOnce = 12'000;

}  // namespace

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
    ++link.offered;
    link.connection->expect_incoming(channel.channel);
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
  for (const ChannelId channel : withdraw.channels) {
    if (service_exports.on_withdraw(link, channel, now)) continue;  // of requests to us
    if (!imports.on_withdraw(link, channel, now) &&
        !service_imports.on_withdraw(link, channel, now))
      return Error{CloseCode::kUnknownChannel, "a channel that does not exist was withdrawn"};
    TimePoint& paid_until = link.withdrawals_paid_until;
    paid_until = std::max(paid_until, now.steady) + kWithdrawalPeriod;
    if (paid_until - now.steady > kWithdrawalsAtOnce * kWithdrawalPeriod)
      return Error{CloseCode::kTooLarge, "channels are offered and withdrawn too often"};
    --link.offered;
    if (link.connection) link.connection->forget_incoming(channel);
  }
  return Nothing{};
}

Result<Nothing> Side::State::on_attach(Link& link, const Attach& attach, const Now& now) {
  if (exports.is_offered(link.id, attach.channel) ||
      service_imports.sends_on(link.id, attach.channel))
    return Error{CloseCode::kIllegal, "attached to a channel that is no service"};
  return service_exports.on_attach(link, attach, now);
}

Result<Nothing> Side::State::on_message(Link& link, InMessage& message, const Now& now) {
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
  link.offered = 0;
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
