#include "core/wire/control.hpp"

#include <utility>

#include "core/wire/control_fields.hpp"
#include "core/wire/control_reader.hpp"
#include "core/wire/control_shape.hpp"
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

}  // namespace

std::size_t patterns_of(const Accepts& accepts) {
  std::size_t count = accepts.deny.size();
  for (const auto& rule : accepts.rules)
    count += rule.topics.size() + rule.services.size() + rule.actions.size() +
             rule.parameters.size() + rule.types.size();
  return count;
}

std::string encode(const Control& message) {
  OrderedJson json;
  json["type"] = kControlTypes[message.index()];
  return std::visit([&](const auto& kind) { return text_of(kind, std::move(json)); }, message);
}

std::vector<std::string> encode_offers(const std::vector<ChannelOffer>& channels, bool complete) {
  // A message arrives as a whole, and nothing else meanwhile: on a thin link urgent data would wait
  // for a long one, and the peer take this side for silent. A single channel may be longer.
  constexpr std::size_t kBytes = 16 << 10;
  constexpr std::size_t kChannels = kOfferChannelsMax / 4;
  std::vector<std::string> offers;
  std::vector<std::string> gathered;
  std::size_t gathered_bytes = 0;
  for (const auto& channel : channels) {
    std::string text = text_of(channel);
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

Result<Control> decode_control(std::string_view text) {
  if (text.size() > kControlBytesMax) {
    return Error{CloseCode::kTooLarge, "a control message is larger than 1 MiB"};
  }
  // Limits before the parser: what it makes of a text may be many times as large as the text.
  if (auto shape = check_control_shape(text); !shape) return shape.error();
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object())
    return Error{CloseCode::kMalformed, "a control message is not a JSON object"};
  std::optional<Error> error;
  ControlReader reader{json, error};
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
