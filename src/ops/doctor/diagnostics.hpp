// The reports of a side on /diagnostics (diagnostic_msgs, levels of REP 107): a view of its status.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/time.hpp"
#include "ops/status/status_json.hpp"

namespace connect_bridge {

struct Diagnostic {
  enum class Level : std::uint8_t { kOk, kWarn, kError };
  Level level = Level::kOk;
  std::string name;     // "connect_server: link 1"
  std::string message;  // what there is to do something about; all of it
  std::vector<std::pair<std::string, std::string>> values;  // named as in the JSON of the status

  // Keeps the worst level, and all texts.
  void add(Level worse, const std::string& text);
};

// The side, its certificate if it shows one, and each link with its path, the login among it.
// Neither people nor addresses are in it: whoever
// may see the topic, perhaps at a peer, is none of those who may look at the status.
[[nodiscard]] std::vector<Diagnostic> diagnostics_of(const StatusPicture& picture, Stamp now);

// A diagnostic_msgs/msg/DiagnosticArray, serialized.
[[nodiscard]] Payload diagnostic_array(const std::vector<Diagnostic>& all,
                                       const std::string& hardware_id, Stamp now);

}  // namespace connect_bridge
