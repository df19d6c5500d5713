// From the status of a running program to causes: for `ctl doctor`. Pure functions of values.
// One unit: the conditions, of a side, its links and what crosses them, share the side's facts.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "config/config.hpp"
#include "core/base/ids.hpp"
#include "core/base/json.hpp"
#include "core/video/picture.hpp"
#include "core/wire/control.hpp"
#include "ops/doctor/findings.hpp"

namespace connect_bridge {

// The keys of a rule that explain what its topics lack.
struct RuleFacts {
  double max_age = 0;  // s; 0: none
  bool urgent = false;
  bool limits_bytes = false;
  bool halts = false;
  bool exact = false;  // `lossy: never`
};

// A name in a rule: below a key of topics, services or actions.
struct RuleName {
  std::string rule, key;  // "look", "export_services"
  Direction direction = Direction::kExport;
  OpenedBy kind = OpenedBy::kNothing;
  Pattern pattern;
};

// The parameters of a running side, as far as they are known.
struct SideFacts {
  bool may_export = true;              // some rule lets something out
  std::uint64_t bytes_per_second = 0;  // the limit that somebody has set; 0: none
  std::map<std::string, RuleFacts> rules = {};
  std::vector<RuleName> names = {};  // in rules, without `prefix`
  double dead_after = 0;             // s; 0: not known
  // Server: identities of which no token is valid any longer.
  std::vector<std::string> expired = {};
  bool video = video::available();             // the build makes video of pictures
  std::string limit_key = "bytes_per_second";  // that has set the limit
};

// A running side or relay, by its status (docs/status.md).
[[nodiscard]] std::vector<Found> diagnose_status(const Json& status, const SideFacts& facts = {});
// The facts of a configuration.
[[nodiscard]] SideFacts facts_of(const Config& config);
// The findings of each open link that its peer is told. A name is that of a topic or service.
[[nodiscard]] std::map<LinkId, std::vector<PeerFinding>> findings_for_peers(const Json& status,
                                                                            const SideFacts& facts);
// The topics that a side brings into its graph, by the messages of the last minutes.
[[nodiscard]] std::set<std::string> brought_topics(const Json& status);
// Whether something crosses: then the graph of the side is the right one, whatever this shell has.
[[nodiscard]] bool carries_data(const Json& status);

}  // namespace connect_bridge
