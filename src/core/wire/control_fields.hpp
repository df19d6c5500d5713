// The JSON form of each control message, described once. A ControlReader and a ControlWriter
// run over the descriptions: the writer in this order, the reader wherever the members stand.
// docs/protocol.md section "Control messages".
//
// Both have these functions:
//   member     a value; its type sets the range: an id is at least 1, a string is a name
//   text       a string with a limit of its own
//   cleaned    text for people: invalid characters are replaced; optional for a reader
//   list       values, with a limit of their number
//   word       an enumerator; optional for a reader
//   optional_word  an enumerator that may be absent
//   flags      members that are true, as a list of their words; optional, unknown words are ignored
//   duration   absent if it is forever
//   check      a condition that only the reader checks
#pragma once

#include <array>
#include <concepts>
#include <string_view>
#include <type_traits>
#include <variant>

#include "core/wire/control.hpp"
#include "core/wire/login.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {

// The condition for the presence of a member in a JSON object.
enum class Presence {
  kRequired,  // always
  kDefault,   // always written; a reader keeps the default without it
  kOptional,  // written unless it is the default
};

// A `Message` that is read, or a const one that is written.
template <class T, class Message>
concept Is = std::same_as<std::remove_const_t<T>, Message>;

// The "type" of each message, in the order of Control.
inline constexpr auto kControlTypes = std::to_array<std::string_view>(
    {"offer", "origins", "withdraw", "demand", "accepts", "decline", "attach", "attached", "refuse",
     "forget", "renew", "renewed", "listeners", "ask", "answer", "wheel", "findings"});
static_assert(kControlTypes.size() == std::variant_size_v<Control>);

void fields(auto& io, Is<Qos> auto& qos) {
  io.word("reliability", qos.reliability, kReliabilityWords);
  io.word("durability", qos.durability, kDurabilityWords);
  io.word("history", qos.history, kHistoryWords);
  io.member("depth", qos.depth, Presence::kDefault);
  io.duration("deadline_ns", qos.deadline);
  io.duration("lifespan_ns", qos.lifespan);
  io.word("liveliness", qos.liveliness, kLivelinessWords);
  io.duration("liveliness_lease_ns", qos.liveliness_lease);
}

void fields(auto& io, Is<OriginOffer> auto& origin) {
  io.member("origin", origin.origin);
  io.member("gid", origin.gid);
  io.cleaned("node", origin.node, kNameBytesMax);
  io.member("qos", origin.qos);
}

void fields(auto& io, Is<ChannelOffer> auto& channel) {
  io.member("channel", channel.channel);
  io.member("kind", channel.kind);
  io.member("name", channel.name);
  const bool service = channel.kind == InterfaceKind::kService;
  const bool known = service || channel.kind == InterfaceKind::kTopic;
  if (!io.kWrites && !known) return;  // it is declined: the rest is not read
  io.member("type", channel.type);
  io.member("action_type", channel.action_type, Presence::kOptional);
  if (!service) io.member("type_hash", channel.type_hash, Presence::kDefault);
  io.word("priority", channel.priority, kPriorityWords);
  if (service) {
    io.cleaned("node", channel.node, kNameBytesMax);
    io.member("epoch", channel.epoch);
    io.check(channel.epoch > 0, "epoch", "is not an integer in its range");
  } else {
    io.member("newest_only", channel.newest_only, Presence::kDefault);
    io.member("resume", channel.resume, Presence::kOptional);
    io.list("origins", channel.origins, kAddedMax);
  }
}

// A word of [a-z0-9_], 1 to 32 bytes.
void identifier(auto& io, std::string_view name, auto& word,
                Presence presence = Presence::kRequired) {
  if (io.text(name, word, kCodeBytesMax, presence))
    io.check(is_method(word), name, "is not a word of [a-z0-9_]");
}

void fields(auto& io, Is<Offer> auto& offer) {
  io.list("channels", offer.channels, kOfferChannelsMax);
  io.member("complete", offer.complete, Presence::kDefault);
}

void fields(auto& io, Is<OriginsChanged> auto& changed) {
  io.member("channel", changed.channel);
  io.list("added", changed.added, kAddedMax);
  io.list("removed", changed.removed, kRemovedMax);
  io.member("too_large", changed.too_large, Presence::kOptional);
  io.member("too_large_bytes", changed.too_large_bytes, Presence::kOptional);
}

void fields(auto& io, Is<Withdraw> auto& withdraw) {
  io.list("channels", withdraw.channels, kChannelIdsMax);
  identifier(io, "code", withdraw.code, Presence::kOptional);
  if (io.kWrites && withdraw.code.empty()) return;
  io.cleaned("reason", withdraw.reason, kReasonBytesMax);
}

void fields(auto& io, Is<HeldSamples> auto& held) {
  io.member("origin", held.origin);
  io.member("number", held.number);
}

void fields(auto& io, Is<ChannelDemand> auto& demand) {
  io.member("channel", demand.channel);
  io.member("number", demand.number);
  io.member("resume", demand.resume, Presence::kOptional);
  io.member("after", demand.after, Presence::kOptional);
  io.member("live", demand.live, Presence::kOptional);
  io.flags("decodes", demand.decodes, kDecodesWords, kDecodesMax);
  io.member("lossy", demand.lossy, Presence::kOptional);
  io.list("has", demand.has, kHasMax, Presence::kOptional);
}

void fields(auto& io, Is<Demand> auto& demand) {
  io.list("channels", demand.channels, kDemandChannelsMax);
}

void fields(auto& io, Is<Wheel> auto& wheel) {
  io.member("channel", wheel.channel);
  io.optional_word("state", wheel.state, kWheelStateWords);
  io.optional_word("want", wheel.want, kWheelWantWords);
  io.check(wheel.state.has_value() != wheel.want.has_value(), "state",
           "and \"want\" are not exactly one");
}

void fields(auto& io, Is<PeerFinding> auto& finding) {
  identifier(io, "id", finding.id);
  io.text("name", finding.name, kNameBytesMax, Presence::kOptional);
}

void fields(auto& io, Is<Findings> auto& findings) {
  io.list("list", findings.list, kFindingsMax);
}

void fields(auto& io, Is<AcceptedNames> auto& names) {
  io.list("topics", names.topics, kAcceptEntriesMax);
  io.list("services", names.services, kAcceptEntriesMax, Presence::kOptional);
  io.list("actions", names.actions, kAcceptEntriesMax, Presence::kOptional);
  io.list("parameters", names.parameters, kAcceptEntriesMax, Presence::kOptional);
  io.list("types", names.types, kAcceptEntriesMax);
}

void fields(auto& io, Is<Accepts> auto& accepts) {
  io.list("rules", accepts.rules, kAcceptRulesMax);
  io.list("deny", accepts.deny, kAcceptEntriesMax);
  const AcceptsSize size = size_of(accepts);
  io.check(size.entries <= kAcceptEntriesMax, "rules",
           "and \"deny\" have too many entries together", CloseCode::kTooLarge);
  io.check(size.wildcards <= kWildcardsMax, "rules",
           "and \"deny\" have too many patterns with wildcards", CloseCode::kTooLarge);
  io.check(size.wildcard_bytes <= kWildcardBytesMax, "rules",
           "and \"deny\" have too long patterns with wildcards", CloseCode::kTooLarge);
  io.member("message_bytes_max", accepts.message_bytes_max, Presence::kOptional);
  io.member("ros_time", accepts.ros_time, Presence::kOptional);
  identifier(io, "robot", accepts.robot, Presence::kOptional);
  io.member("base", accepts.base, Presence::kOptional);
  io.member("findings", accepts.findings, Presence::kOptional);
}

void fields(auto& io, Is<Decline> auto& decline) {
  io.member("channel", decline.channel);
  identifier(io, "code", decline.code);
  io.cleaned("reason", decline.reason, kReasonBytesMax);
}

void fields(auto& io, Is<ListenerReport> auto& report) {
  io.member("listener", report.listener);
  io.member("name", report.name);
  io.member("type", report.type);
  io.cleaned("type_hash", report.type_hash, kNameBytesMax);
}

void fields(auto& io, Is<Listeners> auto& listeners) {
  io.list("added", listeners.added, kAddedMax);
  io.list("removed", listeners.removed, kRemovedMax);
}

void fields(auto& io, Is<AskedName> auto& asked) {
  io.member("kind", asked.kind);
  io.member("name", asked.name);
  io.member("type", asked.type);
}

void fields(auto& io, Is<Ask> auto& ask) {
  io.list("names", ask.names, kAskedMax);
}

void fields(auto& io, Is<Answered> auto& answer) {
  io.list("codes", answer.codes, kAskedMax);
  for (const auto& code : answer.codes) {
    io.check(code.size() <= kCodeBytesMax, "codes", "has a code that is too long",
             CloseCode::kTooLarge);
    io.check(is_method(code), "codes", "has an entry that is not a word of [a-z0-9_]");
  }
}

void fields(auto& io, Is<Attach> auto& attach) {
  io.member("channel", attach.channel);
  io.member("requests", attach.requests);
}

void fields(auto& io, Is<Attached> auto& attached) {
  io.member("channel", attached.channel);
  io.member("requests", attached.requests);
  io.member("seen", attached.seen.value, Presence::kDefault);
  io.list("calls", attached.calls, kCallIdsMax);
  io.cleaned("type_hash", attached.type_hash, kNameBytesMax);
}

void fields(auto& io, Is<Refuse> auto& refuse) {
  io.member("channel", refuse.channel);
  io.list("calls", refuse.calls, kCallIdsMax);
  identifier(io, "code", refuse.code);
  io.cleaned("reason", refuse.reason, kReasonBytesMax);
}

void fields(auto& io, Is<Forget> auto& forget) {
  io.member("channel", forget.channel);
  io.list("calls", forget.calls, kCallIdsMax);
}

void fields(auto& io, Is<Renew> auto& renew) {
  identifier(io, "method", renew.method);
  io.text("credential", renew.credential, kCredentialBytesMax, Presence::kRequired);
}

void fields(auto& io, Is<Renewed> auto& renewed) {
  io.member("accepted", renewed.accepted);
}

}  // namespace connect_bridge
