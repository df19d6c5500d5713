#include "core/wire/control_qos.hpp"

namespace connect_bridge {
namespace {

void put_duration(const char* key, Duration duration, OrderedJson& json) {
  if (duration >= Duration::zero() && duration <= kDurationMax) json[key] = duration.count();
}

}  // namespace

OrderedJson json_of(const Qos& qos) {
  OrderedJson json;
  json["reliability"] = word_of(kReliabilityWords, qos.reliability);
  json["durability"] = word_of(kDurabilityWords, qos.durability);
  json["history"] = word_of(kHistoryWords, qos.history);
  json["depth"] = qos.depth;
  put_duration("deadline_ns", qos.deadline, json);
  put_duration("lifespan_ns", qos.lifespan, json);
  json["liveliness"] = word_of(kLivelinessWords, qos.liveliness);
  put_duration("liveliness_lease_ns", qos.liveliness_lease, json);
  return json;
}

Qos read_qos(ControlReader& reader, const Json& json) {
  const Json* member = reader.find(json, "qos");
  if (member == nullptr) return {};
  const Json& object = reader.object(*member, "qos");
  Qos qos;
  qos.reliability = reader.word(object, "reliability", kReliabilityWords, qos.reliability);
  qos.durability = reader.word(object, "durability", kDurabilityWords, qos.durability);
  qos.history = reader.word(object, "history", kHistoryWords, qos.history);
  qos.depth = reader.optional_number(object, "depth");
  qos.deadline = reader.duration(object, "deadline_ns");
  qos.lifespan = reader.duration(object, "lifespan_ns");
  qos.liveliness = reader.word(object, "liveliness", kLivelinessWords, qos.liveliness);
  qos.liveliness_lease = reader.duration(object, "liveliness_lease_ns");
  return qos;
}

}  // namespace connect_bridge
