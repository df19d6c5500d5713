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
  for (auto& [id, entry] : links)
    if (entry.open() && entry.accepts) recheck(entry, now);
  service_exports.go_on(now);
}

void Side::State::hold_actions(const Now& now) {
  for (const auto& use : service_exports.take_action_uses())
    exports.hold_action(use.action, use.on, now);
}

void Side::State::send_offers(LinkEntry& entry, const Now& now) {
  std::vector<ChannelOffer> offers;
  exports.collect_offers(entry, offers);
  service_exports.collect_offers(entry, offers, now);
  if (offers.empty() && entry.offers_complete) return;
  for (auto& text : encode_offers(offers, !entry.offers_complete)) entry.send(std::move(text));
  entry.offers_complete = true;
}

void Side::State::send_offers(const Now& now) {
  for (auto& [id, entry] : links)
    if (entry.open() && entry.accepts) send_offers(entry, now);
}

void Side::State::recheck(LinkEntry& entry, const Now& now) {
  exports.recheck(entry, now);
  service_exports.recheck(entry, now);
  send_offers(entry, now);
}

Result<Nothing> Side::State::on_offer(LinkEntry& entry, const Offer& offer, const Now& now) {
  for (const auto& channel : offer.channels) {
    if (!channel.channel || entry.link->is_expected(channel.channel))
      return Error{CloseCode::kIllegal, "a channel number was offered twice"};
    if (entry.offered >= options.channels_max)
      return Error{CloseCode::kTooLarge, "more channels offered than this side accepts"};
    ++entry.offered;
    entry.link->expect_incoming(channel.channel);
    if (channel.kind == InterfaceKind::kService) {
      service_imports.on_offer(entry, channel, now);
    } else {
      imports.on_offer(entry, channel, now);
    }
  }
  if (offer.complete) forget_orphans(entry.id, now);
  return Nothing{};
}

Result<Nothing> Side::State::on_withdraw(LinkEntry& entry, const Withdraw& withdraw,
                                         const Now& now) {
  for (const ChannelId channel : withdraw.channels) {
    if (service_exports.on_withdraw(entry, channel, now)) continue;  // of requests to us
    if (!imports.on_withdraw(entry, channel, now) &&
        !service_imports.on_withdraw(entry, channel, now))
      return Error{CloseCode::kUnknownChannel, "a channel that does not exist was withdrawn"};
    TimePoint& paid_until = entry.withdrawals_paid_until;
    paid_until = std::max(paid_until, now.steady) + kWithdrawalPeriod;
    if (paid_until - now.steady > kWithdrawalsAtOnce * kWithdrawalPeriod)
      return Error{CloseCode::kTooLarge, "channels are offered and withdrawn too often"};
    --entry.offered;
    if (entry.link) entry.link->forget_incoming(channel);
  }
  return Nothing{};
}

Result<Nothing> Side::State::on_attach(LinkEntry& entry, const Attach& attach, const Now& now) {
  if (exports.is_offered(entry.id, attach.channel) ||
      service_imports.sends_on(entry.id, attach.channel))
    return Error{CloseCode::kIllegal, "attached to a channel that is no service"};
  return service_exports.on_attach(entry, attach, now);
}

Result<Nothing> Side::State::on_message(LinkEntry& entry, InMessage& message, const Now& now) {
  if (auto result = imports.on_message(entry, message, now)) return *std::move(result);
  if (auto result = service_imports.on_message(entry, message)) return *std::move(result);
  if (auto result = service_exports.on_message(entry, message, now)) return *std::move(result);
  return Error{CloseCode::kUnknownChannel, "a message for a channel that does not exist"};
}

void Side::State::forget_orphans(LinkId link, const Now& now) {
  imports.forget_orphans(link, now);
  service_imports.forget_orphans(link, now);
}

void Side::State::on_link_lost(LinkEntry& entry, const Now& now) {
  exports.on_link_lost(entry.id);
  imports.on_link_lost(entry.id, now);
  service_exports.on_link_lost(entry.id);
  service_imports.on_link_lost(entry.id);
  entry.offered = 0;
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
