#include "core/topics/sample_content.hpp"

#include <algorithm>

#include "core/base/cdr.hpp"

namespace connect_bridge {
namespace {

// FNV-1a: the same on every machine.
void mix(std::uint64_t& hash, std::string_view text) {
  constexpr std::uint64_t kPrime = 0x100000001b3;
  for (const char c : text) hash = (hash ^ static_cast<std::uint8_t>(c)) * kPrime;
  hash = (hash ^ 0x100U) * kPrime;  // "ab" + "c" is not "a" + "bc"
}

std::optional<std::uint64_t> frames_of(ByteView sample) {
  std::uint64_t hash = 0xcbf29ce484222325;
  CdrReader reader(sample);
  const auto transforms = reader.u32();
  for (std::uint32_t i = 0; transforms && i < *transforms; ++i) {
    if (!reader.u32() || !reader.u32()) return std::nullopt;  // the stamp
    const auto parent = reader.string();
    const auto child = reader.string();
    if (!parent || !child) return std::nullopt;
    mix(hash, *parent);
    mix(hash, *child);
    for (int number = 0; number < 7; ++number)  // translation and rotation
      if (!reader.u64()) return std::nullopt;
  }
  return transforms ? std::optional(hash) : std::nullopt;
}

}  // namespace

Stamp header_stamp(ByteView sample) {
  CdrReader reader(sample);
  const auto seconds = reader.u32();
  const auto nanoseconds = reader.u32();
  constexpr std::uint32_t kSecondsMax = 0x7fffffff;
  if (!seconds || !nanoseconds || *seconds > kSecondsMax || *nanoseconds >= kStampSecond) return 0;
  return Stamp{*seconds} * kStampSecond + *nanoseconds;
}

std::optional<std::uint64_t> state_of(std::string_view type, ByteView sample) {
  return type == "tf2_msgs/msg/TFMessage" ? frames_of(sample) : 0;
}

std::optional<std::string_view> node_of_parameter_event(ByteView sample) {
  CdrReader reader(sample);
  // The stamp. The reader takes little-endian plain CDR (00 01) and nothing else.
  if (!reader.u32() || !reader.u32()) return std::nullopt;
  return reader.string();
}

bool is_event_of(const std::string& node, ByteView sample, const NameMap& names,
                 const TopicState* local) {
  // Nodes act on each event with their name, whoever publishes it (docs/protocol.md section 9.12,
  // rule 3). So a peer with rights for one node must not publish for another of its nodes. No peer
  // may publish for a node that lives here.
  const auto told = node_of_parameter_event(sample);
  if (!told || (*told != node && *told != names.to_local(node))) return false;
  return !local || std::none_of(local->publishers.begin(), local->publishers.end(),
                                [&](const Endpoint& e) { return node_of(e) == *told; });
}

}  // namespace connect_bridge
