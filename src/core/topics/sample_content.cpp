#include "core/topics/sample_content.hpp"

#include <algorithm>

#include "core/base/cdr.hpp"
#include "core/policy/interface.hpp"
#include "core/video/packets.hpp"

namespace connect_bridge {
namespace {

// FNV-1a: the same on every machine.
void mix(std::uint64_t& hash, std::string_view text) {
  constexpr std::uint64_t kPrime = 0x100000001b3;
  for (const char c : text) hash = (hash ^ static_cast<std::uint8_t>(c)) * kPrime;
  hash = (hash ^ 0x100U) * kPrime;  // "ab" + "c" is not "a" + "bc"
}

constexpr std::uint64_t kHashOfNothing = 0xcbf29ce484222325;  // FNV's

std::optional<std::uint64_t> frames_of(ByteView sample) {
  std::uint64_t hash = kHashOfNothing;
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

// The names in a DiagnosticArray: header; then level, name, message, hardware, keys and values of
// each part.
std::optional<std::uint64_t> parts_of(ByteView sample) {
  std::uint64_t hash = kHashOfNothing;
  CdrReader reader(sample);
  if (!reader.u32() || !reader.u32() || !reader.string()) return std::nullopt;
  const auto parts = reader.u32();
  for (std::uint32_t i = 0; parts && i < *parts; ++i) {
    if (!reader.u8()) return std::nullopt;
    const auto name = reader.string();
    if (!name || !reader.string()) return std::nullopt;
    const auto hardware = reader.string();
    const auto values = reader.u32();
    if (!hardware || !values) return std::nullopt;
    mix(hash, *name);
    mix(hash, *hardware);
    for (std::uint32_t n = 0; n < *values; ++n)
      if (!reader.string() || !reader.string()) return std::nullopt;
  }
  return parts ? std::optional(hash) : std::nullopt;
}

// The names in a JointState: header; names; numbers.
std::optional<std::uint64_t> joints_of(ByteView sample) {
  std::uint64_t hash = kHashOfNothing;
  CdrReader reader(sample);
  if (!reader.u32() || !reader.u32() || !reader.string()) return std::nullopt;
  const auto joints = reader.u32();
  for (std::uint32_t i = 0; joints && i < *joints; ++i) {
    const auto name = reader.string();
    if (!name) return std::nullopt;
    mix(hash, *name);
  }
  return joints ? std::optional(hash) : std::nullopt;
}

constexpr std::string_view kLog = "rcl_interfaces/msg/Log";
constexpr std::string_view kDiagnostics = "diagnostic_msgs/msg/DiagnosticArray";

// The fields of a message: a digit for a number of so many bytes, s for a string, N for the string
// that is renamed, brackets around the fields of a sequence's elements.
std::string_view fields_of(std::string_view type) {
  if (type == kParameterEventType)
    return "44N(s1188s(1)(1)(8)(8)(s))(s1188s(1)(1)(8)(8)(s))(s1188s(1)(1)(8)(8)(s))";
  if (type == kLog) return "441Nsss4";
  if (type == kDiagnostics) return "44s(1Nss(ss))";
  return {};
}

class Renaming {
 public:
  template <class Rename>
  Renaming(ByteView sample, std::string_view fields, const Rename& rename) : reader_(sample) {
    copies_ = copy(fields, rename);
  }
  [[nodiscard]] std::optional<Payload> take() {
    return copies_ ? std::optional(writer_.take()) : std::nullopt;
  }

 private:
  static std::size_t end_of_sequence(std::string_view fields, std::size_t begin) {
    std::size_t depth = 0;
    for (std::size_t at = begin; at < fields.size(); ++at) {
      if (fields[at] == '(') ++depth;
      if (fields[at] == ')' && --depth == 0) return at;
    }
    return fields.size();
  }
  template <class Rename>
  bool copy(std::string_view fields, const Rename& rename) {
    for (std::size_t at = 0; at < fields.size(); ++at) {
      switch (fields[at]) {
        case '1': {
          const auto value = reader_.u8();
          if (!value) return false;
          writer_.u8(*value);
          break;
        }
        case '4': {
          const auto value = reader_.u32();
          if (!value) return false;
          writer_.u32(*value);
          break;
        }
        case '8': {
          const auto value = reader_.u64();
          if (!value) return false;
          writer_.u64(*value);
          break;
        }
        case '(': {
          const auto count = reader_.u32();
          if (!count) return false;
          writer_.u32(*count);
          const std::size_t end = end_of_sequence(fields, at);
          const auto element = fields.substr(at + 1, end - at - 1);
          for (std::uint32_t i = 0; i < *count; ++i)
            if (!copy(element, rename)) return false;
          at = end;
          break;
        }
        default: {
          const auto text = reader_.string();
          if (!text) return false;
          writer_.string(fields[at] == 'N' ? rename(*text) : std::string(*text));
        }
      }
    }
    return true;
  }

  CdrReader reader_;
  CdrWriter writer_;
  bool copies_ = false;
};

// A logger is called after its node, with dots.
std::string local_logger(std::string_view logger, const NameMap& names) {
  std::string node = "/" + std::string(logger);
  std::replace(node.begin(), node.end(), '.', '/');
  std::string local = names.to_local(node).substr(1);
  std::replace(local.begin(), local.end(), '/', '.');
  return local;
}

std::string local_part(std::string_view part, const NameMap& names) {
  if (part.starts_with('/')) return names.to_local(part);
  return names.to_local("/" + std::string(part)).substr(1);
}

}  // namespace

std::optional<Payload> with_local_names(const std::string& topic, std::string_view type,
                                        ByteView sample, const NameMap& names) {
  const std::string_view fields = fields_of(type);
  if (fields.empty() || names.prefix().empty() || topic.starts_with(names.prefix() + "/"))
    return std::nullopt;
  return Renaming(sample, fields,
                  [&](std::string_view name) {
                    if (type == kLog) return local_logger(name, names);
                    if (type == kDiagnostics) return local_part(name, names);
                    return names.to_local(name);
                  })
      .take();
}

Stamp header_stamp(ByteView sample) {
  CdrReader reader(sample);
  const auto seconds = reader.u32();
  const auto nanoseconds = reader.u32();
  constexpr std::uint32_t kSecondsMax = 0x7fffffff;
  if (!seconds || !nanoseconds || *seconds > kSecondsMax || *nanoseconds >= kStampSecond) return 0;
  return Stamp{*seconds} * kStampSecond + *nanoseconds;
}

std::optional<std::uint64_t> state_of(std::string_view type, ByteView sample) {
  if (type == "tf2_msgs/msg/TFMessage") return frames_of(sample);
  if (type == kDiagnostics) return parts_of(sample);
  if (type == "sensor_msgs/msg/JointState") return joints_of(sample);
  return 0;
}

PacketFacts packet_of(std::string_view type, ByteView sample) {
  const auto packet = video::read_packet(type, sample);
  if (!packet) return {};
  std::uint64_t camera = kHashOfNothing;
  mix(camera, packet->frame_id);
  return {packet->is_key ? VideoPart::kKey : VideoPart::kRefers, camera};
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
  const auto named = node_of_parameter_event(sample);
  const std::string name_here = names.to_local(node);
  if (!named || (*named != node && *named != name_here)) return false;
  return !local || std::none_of(local->publishers.begin(), local->publishers.end(),
                                [&](const Endpoint& e) { return node_of(e) == name_here; });
}

}  // namespace connect_bridge
