#include "core/wire/control_listeners.hpp"

#include <utility>

#include "core/wire/control_qos.hpp"

namespace connect_bridge {
namespace {

std::vector<ListenerId> read_removed(ControlReader& reader, const Json& json) {
  std::vector<ListenerId> removed;
  const Json* list = reader.array(json, "removed", kListenersMax);
  if (list == nullptr) return removed;
  for (const Json& entry : *list) {
    removed.push_back({reader.number_of(entry, "removed", 1U)});
    if (reader.failed()) break;
  }
  return removed;
}

}  // namespace

Listeners read_listeners(ControlReader& reader, const Json& json) {
  Listeners listeners;
  listeners.removed = read_removed(reader, json);
  const Json* list = reader.array(json, "added", kListenersMax);
  if (list == nullptr) return listeners;
  for (const Json& entry : *list) {
    const Json& object = reader.object(entry, "added");
    ListenerTold told;
    told.listener.value = reader.id(object, "listener");
    told.name = reader.string(object, "name", kNameBytesMax);
    told.type = reader.string(object, "type", kNameBytesMax);
    told.type_hash = reader.optional_string(object, "type_hash", kNameBytesMax);
    told.node = reader.optional_string(object, "node", kNameBytesMax);
    told.qos = read_qos(reader, object);
    if (reader.failed()) break;
    listeners.added.push_back(std::move(told));
  }
  return listeners;
}

void put(const Listeners& message, OrderedJson& json) {
  json["type"] = "listeners";
  auto& added = json["added"] = OrderedJson::array();
  for (const auto& told : message.added) {
    OrderedJson entry;
    entry["listener"] = told.listener.value;
    entry["name"] = told.name;
    entry["type"] = told.type;
    entry["type_hash"] = to_text(told.type_hash, kNameBytesMax);
    entry["node"] = to_text(told.node, kNameBytesMax);
    entry["qos"] = json_of(told.qos);
    added.push_back(std::move(entry));
  }
  auto& removed = json["removed"] = OrderedJson::array();
  for (const ListenerId gone : message.removed) removed.push_back(gone.value);
}

}  // namespace connect_bridge
