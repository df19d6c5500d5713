// JSON text from a peer -> control messages. Everything here is hostile until it is checked.
#include <utility>

#include "core/base/hex.hpp"
#include "core/wire/control.hpp"
#include "core/wire/control_accepts.hpp"
#include "core/wire/control_listeners.hpp"
#include "core/wire/control_qos.hpp"
#include "core/wire/control_reader.hpp"
#include "core/wire/control_shape.hpp"
#include "core/wire/login.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {
namespace {

using Reader = ControlReader;

Gid read_gid(Reader& reader, const Json& json) {
  Gid gid;
  const std::string hex = reader.string(json, "gid", gid.bytes.size() * 2);
  if (!from_hex(hex, gid.bytes)) reader.fail("gid", "is not 48 hexadecimal digits");
  return gid;
}

std::vector<OriginOffer> read_origins(Reader& reader, const Json& json, const char* key) {
  std::vector<OriginOffer> origins;
  const Json* list = reader.array(json, key, kChannelOriginsMax);
  if (list == nullptr) return origins;
  for (const Json& entry : *list) {
    const Json& object = reader.object(entry, key);
    OriginOffer origin;
    origin.origin.value = reader.id(object, "origin");
    origin.gid = read_gid(reader, object);
    origin.node = reader.optional_string(object, "node", kNameBytesMax);
    origin.qos = read_qos(reader, object);
    if (reader.failed()) break;
    origins.push_back(std::move(origin));
  }
  return origins;
}

InterfaceKind read_kind(Reader& reader, const Json& json) {
  return value_of(kKindWords, reader.string(json, "kind", kNameBytesMax))
      .value_or(InterfaceKind::kOther);
}

ChannelOffer read_channel(Reader& reader, const Json& json) {
  ChannelOffer channel;
  channel.channel.value = reader.id(json, "channel");
  channel.kind = read_kind(reader, json);
  channel.name = reader.string(json, "name", kNameBytesMax);
  const bool service = channel.kind == InterfaceKind::kService;
  if (channel.kind != InterfaceKind::kTopic && !service) {
    return channel;  // is declined: the rest is not read
  }
  channel.type = reader.string(json, "type", kNameBytesMax);
  channel.action_type = reader.optional_string(json, "action_type", kNameBytesMax);
  channel.priority = reader.word(json, "priority", kPriorityWords, channel.priority);
  if (service) {
    channel.node = reader.optional_string(json, "node", kNameBytesMax);
    channel.epoch = reader.id(json, "epoch");
    return channel;
  }
  channel.type_hash = reader.optional_string(json, "type_hash", kNameBytesMax);
  channel.newest_only = reader.flag(json, "newest_only", true);
  channel.resume = reader.flag(json, "resume", true);
  channel.origins = read_origins(reader, json, "origins");
  return channel;
}

template <class IdType>
std::vector<IdType> read_ids(Reader& reader, const Json& json, const char* key,
                             std::size_t items_max) {
  std::vector<IdType> ids;
  const Json* list = reader.array(json, key, items_max);
  if (list == nullptr) return ids;
  for (const Json& entry : *list) {
    ids.push_back(IdType{reader.number_of(entry, key, 1U)});
    if (reader.failed()) break;
  }
  return ids;
}

Offer read_offer(Reader& reader, const Json& json) {
  Offer offer;
  offer.complete = reader.flag(json, "complete", true);
  const Json* list = reader.array(json, "channels", kOfferChannelsMax);
  if (list == nullptr) return offer;
  for (const Json& entry : *list) {
    offer.channels.push_back(read_channel(reader, reader.object(entry, "channels")));
    if (reader.failed()) break;
  }
  return offer;
}

OriginsChanged read_origins_changed(Reader& reader, const Json& json) {
  OriginsChanged changed;
  changed.channel.value = reader.id(json, "channel");
  changed.added = read_origins(reader, json, "added");
  changed.removed = read_ids<OriginId>(reader, json, "removed", kChannelOriginsMax);
  return changed;
}

Withdraw read_withdraw(Reader& reader, const Json& json) {
  Withdraw withdraw{read_ids<ChannelId>(reader, json, "channels", kChannelIdsMax)};
  if (json.contains("code")) withdraw.code = reader.identifier(json, "code");
  withdraw.reason = reader.optional_string(json, "reason", kReasonBytesMax);
  return withdraw;
}

Demand read_demand(Reader& reader, const Json& json) {
  Demand demand;
  demand.channels = read_ids<ChannelId>(reader, json, "channels", kChannelIdsMax);
  if (const Json* number = reader.find(json, "number"))
    demand.number = reader.number_of<std::uint16_t>(*number, "number", 0);
  demand.resume = reader.flag(json, "resume", true);
  if (reader.find(json, "after", true) == nullptr) return demand;
  const Json* after = reader.array(json, "after", kChannelIdsMax);
  for (const Json& entry : after ? *after : Json::array()) {
    demand.after.push_back(reader.number_of(entry, "after", 0U));
    if (reader.failed()) break;
  }
  if (demand.after.size() != demand.channels.size())
    reader.fail("after", "does not have a number for each channel");
  return demand;
}

Decline read_decline(Reader& reader, const Json& json) {
  Decline decline;
  decline.channel.value = reader.id(json, "channel");
  decline.code = reader.identifier(json, "code");
  decline.reason = reader.optional_string(json, "reason", kReasonBytesMax);
  return decline;
}

Attach read_attach(Reader& reader, const Json& json) {
  return {{reader.id(json, "channel")}, {reader.id(json, "requests")}};
}

Attached read_attached(Reader& reader, const Json& json) {
  return {{reader.id(json, "channel")},
          {reader.id(json, "requests")},
          {reader.optional_number(json, "seen")},
          read_ids<CallId>(reader, json, "calls", kCallIdsMax),
          reader.optional_string(json, "type_hash", kNameBytesMax)};
}

Refuse read_refuse(Reader& reader, const Json& json) {
  Refuse refuse;
  refuse.channel.value = reader.id(json, "channel");
  refuse.calls = read_ids<CallId>(reader, json, "calls", kCallIdsMax);
  refuse.code = reader.identifier(json, "code");
  refuse.reason = reader.optional_string(json, "reason", kReasonBytesMax);
  return refuse;
}

Forget read_forget(Reader& reader, const Json& json) {
  return {{reader.id(json, "channel")}, read_ids<CallId>(reader, json, "calls", kCallIdsMax)};
}

Description read_description(Reader& reader, const Json& json) {
  return {{reader.id(json, "channel")}, reader.optional_string(json, "text", kDescriptionBytesMax)};
}

Renew read_renew(Reader& reader, const Json& json) {
  return {reader.identifier(json, "method"),
          reader.string(json, "credential", kCredentialBytesMax)};
}

std::optional<Control> read(Reader& reader, const Json& json, std::string_view type) {
  if (type == "offer") return read_offer(reader, json);
  if (type == "origins") return read_origins_changed(reader, json);
  if (type == "withdraw") return read_withdraw(reader, json);
  if (type == "demand") return read_demand(reader, json);
  if (type == "accepts") return read_accepts(reader, json);
  if (type == "decline") return read_decline(reader, json);
  if (type == "listeners") return read_listeners(reader, json);
  if (type == "attach") return read_attach(reader, json);
  if (type == "attached") return read_attached(reader, json);
  if (type == "refuse") return read_refuse(reader, json);
  if (type == "forget") return read_forget(reader, json);
  if (type == "describe")
    return Describe{read_ids<ChannelId>(reader, json, "channels", kDescribesMax)};
  if (type == "description") return read_description(reader, json);
  if (type == "renew") return read_renew(reader, json);
  if (type == "renewed") return Renewed{reader.flag(json, "accepted", false)};
  return std::nullopt;
}

}  // namespace

Result<Control> decode_control(std::string_view text) {
  if (text.size() > kControlBytesMax) {
    return Error{CloseCode::kTooLarge, "a control message is larger than 1 MiB"};
  }
  if (auto shape = check_control_shape(text); !shape) return shape.error();
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object())
    return Error{CloseCode::kMalformed, "a control message is not a JSON object"};
  Reader reader;
  const std::string type = reader.string(json, "type", kNameBytesMax);
  auto message = read(reader, json, type);
  if (reader.failed()) return reader.error();
  if (!message) return Error{CloseCode::kMalformed, "unknown control message \"" + type + "\""};
  return *std::move(message);
}

}  // namespace connect_bridge
