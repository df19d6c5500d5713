// Control messages -> JSON text.
#include <utility>

#include "core/base/hex.hpp"
#include "core/base/json.hpp"
#include "core/wire/control.hpp"
#include "core/wire/control_accepts.hpp"
#include "core/wire/control_listeners.hpp"
#include "core/wire/control_qos.hpp"
#include "core/wire/text.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {
namespace {

OrderedJson json_of(const OriginOffer& origin) {
  OrderedJson json;
  json["origin"] = origin.origin.value;
  json["gid"] = to_hex(origin.gid.bytes);
  json["node"] = to_text(origin.node, kNameBytesMax);
  json["qos"] = json_of(origin.qos);
  return json;
}

OrderedJson json_of(const std::vector<OriginOffer>& origins) {
  OrderedJson json = OrderedJson::array();
  for (const auto& origin : origins) json.push_back(json_of(origin));
  return json;
}

template <class Tag, class Value>
OrderedJson json_of(const std::vector<Id<Tag, Value>>& ids) {
  OrderedJson json = OrderedJson::array();
  for (const auto& id : ids) json.push_back(id.value);
  return json;
}

OrderedJson json_of(const ChannelOffer& channel) {
  OrderedJson json;
  json["channel"] = channel.channel.value;
  json["kind"] = word_of(kKindWords, channel.kind);
  json["name"] = channel.name;
  json["type"] = channel.type;
  if (!channel.action_type.empty()) json["action_type"] = channel.action_type;
  if (channel.kind == InterfaceKind::kService) {
    json["priority"] = word_of(kPriorityWords, channel.priority);
    json["node"] = to_text(channel.node, kNameBytesMax);
    json["epoch"] = channel.epoch;
    return json;
  }
  json["type_hash"] = channel.type_hash;
  json["priority"] = word_of(kPriorityWords, channel.priority);
  json["newest_only"] = channel.newest_only;
  if (channel.resume) json["resume"] = true;
  json["origins"] = json_of(channel.origins);
  return json;
}

void put(const Offer& message, OrderedJson& json) {
  json["type"] = "offer";
  OrderedJson& channels = json["channels"] = OrderedJson::array();
  for (const auto& channel : message.channels) channels.push_back(json_of(channel));
  json["complete"] = message.complete;
}

void put(const OriginsChanged& message, OrderedJson& json) {
  json["type"] = "origins";
  json["channel"] = message.channel.value;
  json["added"] = json_of(message.added);
  json["removed"] = json_of(message.removed);
}

void put(const Withdraw& message, OrderedJson& json) {
  json["type"] = "withdraw";
  json["channels"] = json_of(message.channels);
  if (message.code.empty()) return;
  json["code"] = message.code;
  json["reason"] = to_text(message.reason, kReasonBytesMax);
}

void put(const Demand& message, OrderedJson& json) {
  json["type"] = "demand";
  json["channels"] = json_of(message.channels);
  json["number"] = message.number;
  if (message.resume) json["resume"] = true;
  if (!message.after.empty()) json["after"] = message.after;
}

void put(const Decline& message, OrderedJson& json) {
  json["type"] = "decline";
  json["channel"] = message.channel.value;
  json["code"] = message.code;
  json["reason"] = to_text(message.reason, kReasonBytesMax);
}

void put(const Attach& message, OrderedJson& json) {
  json["type"] = "attach";
  json["channel"] = message.channel.value;
  json["requests"] = message.requests.value;
}

void put(const Attached& message, OrderedJson& json) {
  json["type"] = "attached";
  json["channel"] = message.channel.value;
  json["requests"] = message.requests.value;
  json["seen"] = message.seen.value;
  json["calls"] = json_of(message.calls);
  json["type_hash"] = to_text(message.type_hash, kNameBytesMax);
}

void put(const Refuse& message, OrderedJson& json) {
  json["type"] = "refuse";
  json["channel"] = message.channel.value;
  json["calls"] = json_of(message.calls);
  json["code"] = message.code;
  json["reason"] = to_text(message.reason, kReasonBytesMax);
}

void put(const Forget& message, OrderedJson& json) {
  json["type"] = "forget";
  json["channel"] = message.channel.value;
  json["calls"] = json_of(message.calls);
}

void put(const Describe& message, OrderedJson& json) {
  json["type"] = "describe";
  json["channels"] = json_of(message.channels);
}

void put(const Description& message, OrderedJson& json) {
  json["type"] = "description";
  json["channel"] = message.channel.value;
  if (!message.text.empty()) json["text"] = message.text;
}

void put(const Renew& message, OrderedJson& json) {
  json["type"] = "renew";
  json["method"] = message.method;
  json["credential"] = message.credential;
}

void put(const Renewed& message, OrderedJson& json) {
  json["type"] = "renewed";
  json["accepted"] = message.accepted;
}

// Bytes that are not UTF-8 are replaced: dump() must not throw because of a name in the graph.
std::string dump(const OrderedJson& json) {
  return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
}

std::string offer_of(const std::vector<std::string>& channels, bool complete) {
  std::string text = R"({"type":"offer","channels":[)";
  for (const auto& channel : channels) {
    if (text.back() != '[') text += ',';
    text += channel;
  }
  text += complete ? R"(],"complete":true})" : R"(],"complete":false})";
  return text;
}

}  // namespace

std::string encode(const Control& message) {
  OrderedJson json;
  std::visit([&json](const auto& kind) { put(kind, json); }, message);
  return dump(json);
}

std::vector<std::string> encode_offers(const std::vector<ChannelOffer>& channels, bool complete) {
  // A single channel with the maximum of origins still fits the limits; a quarter keeps messages
  // short.
  constexpr std::size_t kBytes = kControlBytesMax / 4;
  constexpr std::size_t kChannels = kOfferChannelsMax / 4;
  std::vector<std::string> offers;
  std::vector<std::string> gathered;
  std::size_t gathered_bytes = 0;
  for (const auto& channel : channels) {
    std::string text = dump(json_of(channel));
    const bool full = gathered.size() == kChannels || gathered_bytes + text.size() > kBytes;
    if (full && !gathered.empty()) {
      offers.push_back(offer_of(std::exchange(gathered, {}), false));
      gathered_bytes = 0;
    }
    gathered_bytes += text.size();
    gathered.push_back(std::move(text));
  }
  if (!gathered.empty() || complete) offers.push_back(offer_of(gathered, complete));
  return offers;
}

}  // namespace connect_bridge
