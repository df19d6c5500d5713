// How a rule wants the messages of an interface treated. Defaults stand for "as the origin has it"
// or "no limit".
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/priority.hpp"
#include "core/base/qos.hpp"
#include "core/wire/codec.hpp"

namespace connect_bridge {

// Overrides of the origin's QoS on the mirror and on the exporter's subscription.
struct QosOverride {
  std::optional<Reliability> reliability;
  std::optional<Durability> durability;
  std::optional<std::uint32_t> depth;
  bool operator==(const QosOverride&) const = default;
};

// `qos` with what the rule overrides.
inline Qos with_override(Qos qos, const QosOverride& o) {
  if (o.reliability) qos.reliability = *o.reliability;
  if (o.durability) qos.durability = *o.durability;
  if (o.depth) {
    qos.depth = *o.depth;
    qos.history = History::kKeepLast;
  }
  return qos;
}

// What an exporter offers of a publisher. What a volatile one has said is kept nowhere here,
// whatever the rule says: who wants it latched says so at the importing side, which keeps it.
inline Qos qos_to_offer(const Qos& qos, const QosOverride& o) {
  Qos result = with_override(qos, o);
  if (qos.durability == Durability::kVolatile) result.durability = Durability::kVolatile;
  return result;
}

// Which messages of one publisher count where a link carries less than is published: only the
// newest, or all.
enum class Keep : std::uint8_t { kNewest, kAll };

struct Treatment {
  std::optional<Priority> priority;  // none: by name and type, see default_priority()
  Compression compression;
  std::optional<Keep> keep;                // none: see keep_of()
  std::optional<bool> with_large;          // none: see company_of()
  double max_rate = 0;                     // messages per second and publisher; 0: no limit
  std::uint64_t bytes_per_second_max = 0;  // per publisher; 0: no limit
  Duration max_age = kForever;  // older messages are dropped, at the sender and at the importer
  std::uint64_t queue_bytes_max = 0;  // a channel's queue; one message always fits; 0: by the link
  QosOverride qos;
  std::optional<bool> resume;        // none: see resumes()
  std::optional<bool> drives;        // none: see drives()
  std::uint32_t calls_max = 64;      // calls of a service that the real server has at a time
  std::uint32_t server_queue = 10;   // requests that the server's queue keeps; 0: not limited here
  Duration call_timeout = kForever;  // after it a call is given up, except for an action's result
  // A type is used although its definition here is not the peer's.
  bool allow_type_mismatch = false;
  bool operator==(const Treatment&) const = default;
};

}  // namespace connect_bridge
