#include "core/wire/control.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/wire/control_fields.hpp"
#include "core/wire/control_reader.hpp"
#include "core/wire/control_values.hpp"
#include "core/wire/control_writer.hpp"

namespace connect_bridge {
namespace {

// Makes `message` an empty one of this type; false if there is no such type.
template <std::size_t... Index>
bool become(std::string_view type, Control& message, std::index_sequence<Index...>) {
  return (... || (type == kControlTypes[Index] && (message.emplace<Index>(), true)));
}

// The text of `json` with the fields of `object`. Bytes that are not UTF-8 are replaced: dump()
// must not throw because of a name in the graph.
std::string text_of(const auto& object, OrderedJson json = {}) {
  ControlWriter writer{json};
  fields(writer, object);
  return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
}

std::string offer_of(const std::vector<std::string>& channels, bool complete) {
  std::string list;
  for (const auto& channel : channels) list += (list.empty() ? "" : ",") + channel;
  std::string text = encode(Offer{{}, complete});
  return text.insert(text.find('[') + 1, list);
}

template <class T>
std::vector<T> slice(const std::vector<T>& list, std::size_t at, std::size_t count) {
  const auto begin = list.begin() + static_cast<std::ptrdiff_t>(std::min(at, list.size()));
  const auto left = static_cast<std::size_t>(list.end() - begin);
  return {begin, begin + static_cast<std::ptrdiff_t>(std::min(count, left))};
}

// Each has a part of the list, and no other member is changed.
template <class Message, class T>
std::vector<Message> cut(const Message& whole, std::vector<T> Message::*list, std::size_t max) {
  std::vector<Message> parts;
  for (std::size_t at = 0; at == 0 || at < (whole.*list).size(); at += max)
    (parts.emplace_back(whole).*list) = slice(whole.*list, at, max);
  return parts;
}

template <class Message>
std::vector<Message> parts_of(const Message& message) {
  return {message};
}
std::vector<Withdraw> parts_of(const Withdraw& withdraw) {
  return cut(withdraw, &Withdraw::channels, kChannelIdsMax);
}
std::vector<Demand> parts_of(const Demand& demand) {
  auto parts = cut(demand, &Demand::channels, kChannelIdsMax);
  for (std::size_t i = 0; i < parts.size(); ++i)
    parts[i].after = slice(demand.after, i * kChannelIdsMax, kChannelIdsMax);
  return parts;
}
std::vector<Refuse> parts_of(const Refuse& refuse) {
  return cut(refuse, &Refuse::calls, kCallIdsMax);
}
std::vector<Forget> parts_of(const Forget& forget) {
  return cut(forget, &Forget::calls, kCallIdsMax);
}
// All that go are in the first part: the peer applies them first, so it never counts more than its
// limit.
template <class Message>
std::vector<Message> parts_of_change(const Message& change) {
  auto parts = cut(change, &Message::added, kAddedMax);
  for (std::size_t i = 1; i < parts.size(); ++i) parts[i].removed.clear();
  return parts;
}
std::vector<OriginsChanged> parts_of(const OriginsChanged& changed) {
  return parts_of_change(changed);
}
std::vector<Listeners> parts_of(const Listeners& listeners) {
  return parts_of_change(listeners);
}

}  // namespace

AcceptsSize size_of(const Accepts& accepts) {
  AcceptsSize size;
  const auto add = [&](const std::vector<std::string>& patterns) {
    size.entries += patterns.size();
    for (const auto& pattern : patterns) {
      const auto star = pattern.find('*');
      if (star == std::string::npos) continue;
      ++size.wildcards;
      size.wildcard_bytes += pattern.size() - star;
    }
  };
  add(accepts.deny);
  for (const auto& rule : accepts.rules) {
    for (const auto* names : {&rule.topics, &rule.services, &rule.actions, &rule.parameters})
      add(*names);
    size.entries += rule.types.size();
  }
  return size;
}

std::string encode(const Control& message) {
  OrderedJson json;
  json["type"] = kControlTypes[message.index()];
  return std::visit([&](const auto& kind) { return text_of(kind, std::move(json)); }, message);
}

std::vector<std::string> encode_parts(const Control& message) {
  std::vector<std::string> texts;
  std::visit(
      [&](const auto& kind) {
        for (const auto& part : parts_of(kind)) texts.push_back(encode(part));
      },
      message);
  return texts;
}

std::vector<std::string> encode_offers(const std::vector<ChannelOffer>& channels, bool complete) {
  // A message arrives as a whole, and nothing else meanwhile: on a thin link urgent data would wait
  // for a long one, and the peer take this side for silent.
  constexpr std::size_t kBytes = 16 << 10;
  constexpr std::size_t kChannels = kOfferChannelsMax / 4;
  std::vector<std::string> texts;
  std::vector<std::string> gathered;
  std::size_t gathered_bytes = 0;
  const auto offer_gathered = [&](bool completes) {
    if (!gathered.empty() || completes) texts.push_back(offer_of(gathered, completes));
    gathered.clear();
    gathered_bytes = 0;
  };
  for (const auto& channel : channels) {
    OriginsChanged more{channel.channel, {}, {}};
    std::string text;
    if (channel.origins.size() <= kAddedMax) {
      text = text_of(channel);
    } else {
      ChannelOffer first = channel;
      first.origins = slice(channel.origins, 0, kAddedMax);
      more.added = slice(channel.origins, kAddedMax, kChannelOriginsMax);
      text = text_of(first);
    }
    if (gathered.size() == kChannels || gathered_bytes + text.size() > kBytes)
      offer_gathered(false);
    gathered_bytes += text.size();
    gathered.push_back(std::move(text));
    if (more.added.empty()) continue;
    offer_gathered(false);
    for (auto& rest : encode_parts(more)) texts.push_back(std::move(rest));
  }
  offer_gathered(complete);
  return texts;
}

Result<Control> decode_control(std::string_view text) {
  if (text.size() > kControlBytesMax)
    return Error{CloseCode::kTooLarge, "a control message is larger than 256 KiB"};
  const auto values = ControlValues::read(text);
  if (!values) return values.error();
  std::optional<Error> error;
  ControlReader reader{values.value().object(), error};
  std::string type;
  reader.member("type", type);
  Control message;
  if (!error && !become(type, message, std::make_index_sequence<kControlTypes.size()>{}))
    return malformed("unknown control message \"" + type + "\"");
  // The reader keeps the first error and reads nothing after it. Members that are not named in
  // fields() are skipped: later versions may add some (docs/protocol.md section 15).
  std::visit([&reader](auto& kind) { fields(reader, kind); }, message);
  if (error) return *std::move(error);
  return message;
}

}  // namespace connect_bridge
