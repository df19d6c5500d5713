// One question to the rules, and what they and the second opinion on them (sim/rights.hpp) say.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/policy/peer_accepts.hpp"
#include "sim/rights.hpp"

namespace connect_bridge::model {

// The lists of a rule, by their keys.
struct PatternList {
  const char* key;
  std::vector<Pattern>& (*list)(Rule&);
};
template <Direction kDirection, OpenedBy kKind>
std::vector<Pattern>& opened(Rule& rule) {
  return rule.opens[kDirection][kKind];
}
inline constexpr PatternList kPatternLists[] = {
    {"export_topics", opened<Direction::kExport, OpenedBy::kTopics>},
    {"import_topics", opened<Direction::kImport, OpenedBy::kTopics>},
    {"export_services", opened<Direction::kExport, OpenedBy::kServices>},
    {"import_services", opened<Direction::kImport, OpenedBy::kServices>},
    {"export_actions", opened<Direction::kExport, OpenedBy::kActions>},
    {"import_actions", opened<Direction::kImport, OpenedBy::kActions>},
    {"export_parameters", opened<Direction::kExport, OpenedBy::kParameters>},
    {"import_parameters", opened<Direction::kImport, OpenedBy::kParameters>},
    {"deny", [](Rule& rule) -> std::vector<Pattern>& { return rule.deny; }}};
struct NameList {
  const char* key;
  std::vector<std::string> Rule::*list;
};
inline constexpr NameList kNameLists[] = {
    {"types", &Rule::types}, {"identities", &Rule::identities}, {"groups", &Rule::groups}};

struct Asked {
  InterfaceKind kind = InterfaceKind::kTopic;
  std::string name, type, action_type;
  [[nodiscard]] Interface what() const { return {kind, name, type, action_type}; }
};

// The rule that allows it, by the number in `treatment.calls_max`: the treatment is all that the
// second opinion tells. 0: none.
struct RuleOpinions {
  std::uint32_t by = 0;
  std::uint32_t by_second = 0;
  bool told = true;  // a peer that knows only `accepts` gets the same result
  [[nodiscard]] bool agree() const { return by == by_second && told; }
};

// `accepts` is made of policy.accepts(who).
RuleOpinions opinions_of(const Policy& policy, const PeerAccepts& accepts, Direction direction,
                         const Asked& asked, const Identity& who);
// With the whole question.
std::string to_text(const RuleOpinions& opinions, const Policy& policy, Direction direction,
                    const Asked& asked, const Identity& who);

}  // namespace connect_bridge::model
