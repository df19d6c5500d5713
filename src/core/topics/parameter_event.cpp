#include "core/topics/parameter_event.hpp"

#include <algorithm>

#include "core/base/cdr.hpp"

namespace connect_bridge {

std::optional<std::string_view> node_of_parameter_event(ByteView sample) {
  CdrReader reader(sample);
  // The stamp. The reader takes little-endian plain CDR (00 01) and nothing else.
  if (!reader.u32() || !reader.u32()) return std::nullopt;
  return reader.string();
}

bool is_event_of(const std::string& node, ByteView sample, const NameMap& names,
                 const TopicState* local) {
  // Nodes act upon each event that has their name, whoever publishes it (docs/protocol.md section
  // 9.12, rule 3). So a peer with rights for one node must not speak for another one of its own,
  // and none for a node that lives here.
  const auto told = node_of_parameter_event(sample);
  if (!told || (*told != node && *told != names.to_local(node))) return false;
  return !local || std::none_of(local->publishers.begin(), local->publishers.end(),
                                [&](const Endpoint& e) { return node_of(e) == *told; });
}

}  // namespace connect_bridge
