#include "core/offers/link_offer.hpp"

#include <utility>

#include "core/link/link_audit.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {
namespace {

// `part` has local names; for an action it is the goal part, whose rights are those of every part.
void tell_lack(const SideView& side, const Link& link, const std::string& shown, Interface part,
               const TypeLack& lack) {
  const auto wire_name = link.names.to_wire(part.name);
  if (!wire_name) return;
  const std::string type(part.action_type.empty() ? part.type : part.action_type);
  part.name = *wire_name;
  if (export_right(side, link, part).answer != ExportRight::Answer::kYes) return;
  if (side.outputs.logged().first("type_lacking " + type))
    side.outputs.log(LogLevel::kWarn, "cannot export " + shown + ": " + lack.reason);
}

}  // namespace

LinkOffer::~LinkOffer() {
  if (number_) link_.close_channel(number_);
}

std::optional<ChannelOffer> LinkOffer::open(OutgoingChannel& channel) {
  asked_ = true;
  auto right = export_right(side_, link_, *what_);
  if (right.answer != ExportRight::Answer::kYes) return std::nullopt;
  decision_ = std::move(right.decision);
  number_ = link_.open_channel(channel);
  const auto& [name, type] = what_->key;
  ChannelOffer offer;
  offer.channel = number_;
  offer.kind = what_->kind;
  offer.name = wire_name();
  offer.type = type;
  offer.action_type = side_.actions.type_of(what_->kind, name, type).value_or("");
  note(AuditEvent::kChannelOpened);
  return offer;
}

std::optional<Ending> LinkOffer::review(bool used) {
  asked_ = is_open();
  auto right = export_right(side_, link_, *what_);
  switch (right.answer) {
    case ExportRight::Answer::kNotAccepted: return Ending{"the peer does not accept it any longer"};
    case ExportRight::Answer::kForbidden:
      return Ending{"no rule allows exporting it any longer", "not_permitted"};
    case ExportRight::Answer::kNotWhole: return Ending{"a part of its action no longer exists"};
    case ExportRight::Answer::kYes:
    case ExportRight::Answer::kUnknown: break;
  }
  if (is_open() && !used && is_declined() && *declined_under_ != link_.accepts.lists())
    return offered_again();
  if (terms_ == Terms::kFixed && !may_follow(treatment(), right.decision.treatment))
    return offered_again();  // mutant: followed_terms
  decision_ = std::move(right.decision);
  return std::nullopt;
}

void LinkOffer::close(const Ending& why) {
  if (!is_open()) return;
  note(AuditEvent::kChannelEnded, why);
  link_.withdraw(number_, why);
  number_ = {};
}

void LinkOffer::lose() {
  number_ = {};
  asked_ = false;
  declined_under_.reset();
}

void LinkOffer::on_decline(const Decline& decline, const Now& now) {
  note(AuditEvent::kChannelRefused, {decline.reason, decline.code});
  declined_under_ = link_.accepts.lists();
  const auto& [name, type] = what_->key;
  log_decline(side_.outputs, link_, declined_, shown(what_->kind, name, type), decline, now);
}

void LinkOffer::note(AuditEvent event, const Ending& why) const {
  if (!side_.outputs.audits()) return;
  audit(side_.outputs, link_, event,
        {Direction::kExport, what_->kind, wire_name(), what_->key.second, decision().rule},
        why.reason, why.code);
}

void send_offers(Link& link, const std::vector<ChannelOffer>& offers, bool completes) {
  if (offers.empty() && !completes) return;
  auto texts = encode_offers(offers, completes);
  for (std::size_t i = 0; i < texts.size(); ++i)
    link.send(std::move(texts[i]), completes && i + 1 == texts.size());
  // Their other origins come in texts of their own, behind the offer.
  for (const ChannelOffer& offer : offers)
    if (offer.origins.size() > kAddedMax) link.sending().follow_texts(offer.channel);
}

void tell_lack(const SideView& side, const Link& link, const LocalInterface& what) {
  const std::string& name = what.key.first;
  if (has_action_token(name)) {
    const auto part = part_of_action(what.kind, name, what.key.second);
    const auto& lacked = side.actions.lacked();
    const auto action = part ? lacked.find(std::string(part->action)) : lacked.end();
    if (action == lacked.end()) return;
    const std::string goals = name_of_part(action->first, ActionPart::kSendGoal);
    const std::string type = type_of_part(action->second.type, ActionPart::kSendGoal);
    return tell_lack(side, link, "the action " + action->first,
                     {InterfaceKind::kService, goals, type, action->second.type},
                     action->second.lack);
  }
  const auto told = [&](const auto& states) {
    const auto state = states.find(what.key);
    if (state == states.end() || !state->second.lack) return;
    tell_lack(side, link, name, {what.kind, name, what.key.second}, *state->second.lack);
  };
  if (what.kind == InterfaceKind::kTopic) return told(side.graph.topics());
  told(side.graph.services());
}

}  // namespace connect_bridge
