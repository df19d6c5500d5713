#include "core/wire/control.hpp"

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

// Bytes that are not UTF-8 are replaced: a name in the graph must not make this throw.
std::string text_of(const OrderedJson& json) {
  return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
}

// A message arrives as a whole, and nothing else meanwhile. On a thin link urgent data would wait
// for a long one, and the peer would take this side for silent.
constexpr std::size_t kEntriesBytes = 16 << 10;

// Encoded entries of `channels`, gathered into messages of at most kEntriesBytes. A larger entry
// has a message of its own.
class Entries {
 public:
  explicit Entries(std::size_t most) : most_(most) {}

  [[nodiscard]] bool fits(const std::string& entry) const {
    return count_ == 0 || (count_ < most_ && list_.size() + entry.size() < kEntriesBytes);
  }
  [[nodiscard]] bool empty() const { return count_ == 0; }
  void add(const std::string& entry) { list_ += (count_++ == 0 ? "" : ",") + entry; }
  // `message`, without channels, with the gathered entries.
  std::string take(const Control& message) {
    std::string text = encode(message);
    text.insert(text.find('[') + 1, std::exchange(list_, {}));
    count_ = 0;
    return text;
  }

 private:
  std::size_t most_;
  std::size_t count_ = 0;
  std::string list_;
};

std::vector<std::string> encode_demands(const Demand& demand) {
  std::vector<std::string> texts;
  Entries entries(kDemandChannelsMax);
  for (const auto& channel : demand.channels) {
    OrderedJson json;
    ControlWriter writer{json};
    fields(writer, channel);
    const std::string text = text_of(json);
    if (!entries.fits(text)) texts.push_back(entries.take(Demand{}));
    entries.add(text);
  }
  if (!entries.empty() || texts.empty()) texts.push_back(entries.take(Demand{}));
  return texts;
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
  ControlWriter writer{json};
  std::visit([&](const auto& kind) { fields(writer, kind); }, message);
  return text_of(json);
}

std::vector<std::string> encode_parts(const Control& message) {
  if (const auto* demand = std::get_if<Demand>(&message)) return encode_demands(*demand);
  std::vector<std::string> texts;
  for (bool complete = false; !complete;) {
    OrderedJson json;
    json["type"] = kControlTypes[message.index()];
    ControlWriter writer{json, texts.size()};
    std::visit([&](const auto& kind) { fields(writer, kind); }, message);
    complete = writer.is_last_part();
    texts.push_back(text_of(json));
  }
  return texts;
}

std::vector<std::string> encode_offers(const std::vector<ChannelOffer>& channels, bool complete) {
  std::vector<std::string> texts;
  Entries entries(kOfferChannelsMax / 4);
  const auto offer_gathered = [&](bool completes) {
    if (!entries.empty() || completes) texts.push_back(entries.take(Offer{{}, completes}));
  };
  for (const auto& channel : channels) {
    OrderedJson json;
    ControlWriter writer{json, 0};  // with as many origins as one message may add
    fields(writer, channel);
    const std::string text = text_of(json);
    if (!entries.fits(text)) offer_gathered(false);
    entries.add(text);
    if (writer.is_last_part()) continue;
    offer_gathered(false);
    const OriginsChanged more{
        channel.channel, {channel.origins.begin() + kAddedMax, channel.origins.end()}, {}};
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
  // The reader keeps the first error and reads nothing after it. Members not named in fields() are
  // skipped: later versions may add some (docs/protocol.md section 15).
  std::visit([&reader](auto& kind) { fields(reader, kind); }, message);
  if (error) return *std::move(error);
  return message;
}

}  // namespace connect_bridge
