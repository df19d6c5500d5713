#include "core/wire/control_accepts.hpp"

#include <string>
#include <utility>
#include <vector>

#include "core/base/hex.hpp"

namespace connect_bridge {
namespace {

std::vector<std::string> read_strings(ControlReader& reader, const Json& json, const char* key,
                                      bool optional = false) {
  std::vector<std::string> strings;
  if (optional && reader.find(json, key, true) == nullptr) return strings;
  const Json* list = reader.array(json, key, kPatternsMax);
  if (list == nullptr) return strings;
  for (const Json& entry : *list) {
    strings.push_back(reader.string_of(entry, key, kNameBytesMax));
    if (reader.failed()) break;
  }
  return strings;
}

std::vector<Token128> read_neighbours(ControlReader& reader, const Json& json) {
  constexpr const char* kKey = "neighbours";
  std::vector<Token128> sides;
  if (reader.find(json, kKey, true) == nullptr) return sides;
  const Json* list = reader.array(json, kKey, kNeighboursMax);
  for (const Json& entry : list ? *list : Json::array()) {
    Token128& side = sides.emplace_back();
    if (!from_hex(reader.string_of(entry, kKey, side.bytes.size() * 2), side.bytes))
      reader.fail(kKey, "has an entry that is not 32 hexadecimal digits");
    if (reader.failed()) break;
  }
  return sides;
}

}  // namespace

Accepts read_accepts(ControlReader& reader, const Json& json) {
  Accepts accepts;
  accepts.deny = read_strings(reader, json, "deny");
  accepts.message_bytes_max = reader.optional_number(json, "message_bytes_max");
  accepts.ros_time = reader.flag(json, "ros_time", true);
  accepts.neighbours = read_neighbours(reader, json);
  if (const Json* domain = reader.find(json, "domain", true))
    accepts.domain = reader.number_of(*domain, "domain", 0U);
  const Json* list = reader.array(json, "rules", kAcceptRulesMax);
  if (list == nullptr) return accepts;
  for (const Json& entry : *list) {
    const Json& object = reader.object(entry, "rules");
    AcceptedNames names;
    names.topics = read_strings(reader, object, "topics");
    names.services = read_strings(reader, object, "services", true);
    names.actions = read_strings(reader, object, "actions", true);
    names.parameters = read_strings(reader, object, "parameters", true);
    names.types = read_strings(reader, object, "types");
    if (reader.failed()) break;
    accepts.rules.push_back(std::move(names));
  }
  if (patterns_of(accepts) > kPatternsMax) {
    reader.fail("rules", "and \"deny\" have too many entries together", CloseCode::kTooLarge);
  }
  return accepts;
}

std::size_t patterns_of(const Accepts& accepts) {
  std::size_t count = accepts.deny.size();
  for (const auto& rule : accepts.rules)
    count += rule.topics.size() + rule.services.size() + rule.actions.size() +
             rule.parameters.size() + rule.types.size();
  return count;
}

void put(const Accepts& message, OrderedJson& json) {
  json["type"] = "accepts";
  auto& rules = json["rules"] = OrderedJson::array();
  for (const auto& rule : message.rules) {
    OrderedJson entry;
    entry["topics"] = rule.topics;
    if (!rule.services.empty()) entry["services"] = rule.services;
    if (!rule.actions.empty()) entry["actions"] = rule.actions;
    if (!rule.parameters.empty()) entry["parameters"] = rule.parameters;
    entry["types"] = rule.types;
    rules.push_back(std::move(entry));
  }
  json["deny"] = message.deny;
  if (message.message_bytes_max > 0) json["message_bytes_max"] = message.message_bytes_max;
  if (message.ros_time) json["ros_time"] = true;
  for (const auto& side : message.neighbours) json["neighbours"].push_back(to_hex(side.bytes));
  if (message.domain) json["domain"] = *message.domain;
}

}  // namespace connect_bridge
