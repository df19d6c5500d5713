#include "model/rule_opinions.hpp"

namespace connect_bridge::model {
namespace {

std::string shown(const Policy& policy, Direction direction, const Asked& asked,
                  const Identity& who) {
  std::string text = direction == Direction::kExport ? "export " : "import ";
  text += asked.name + " [" + asked.type + "] for " + who.name;
  for (const auto& group : who.groups) text += " +" + group;
  for (Rule rule : policy.rules()) {
    text += "\n  " + rule.name;
    for (const auto& [key, list] : kPatternLists)
      for (const Pattern& pattern : list(rule))
        text += std::string(" ") + key + ":" + pattern.text();
    for (const auto& [key, list] : kNameLists)
      for (const auto& word : rule.*list) text += std::string(" ") + key + ":" + word;
  }
  return text;
}

}  // namespace

RuleOpinions opinions_of(const Policy& policy, const PeerAccepts& accepts, Direction direction,
                         const Asked& asked, const Identity& who) {
  const auto decided = policy.decide(direction, asked.what(), who);
  const auto second =
      asked.kind == InterfaceKind::kTopic
          ? sim::treatment_of(policy, direction, asked.name, asked.type, who)
          : sim::service_treatment_of(policy, direction, asked.name, asked.type, who);
  RuleOpinions opinions;
  if (decided) opinions.by = decided->treatment.calls_max;
  if (second) opinions.by_second = second->calls_max;
  opinions.told =
      direction == Direction::kExport || accepts.takes(asked.what()) == decided.has_value();
  return opinions;
}

std::string to_text(const RuleOpinions& opinions, const Policy& policy, Direction direction,
                    const Asked& asked, const Identity& who) {
  return "rule " + std::to_string(opinions.by) + ", and by the second opinion " +
         std::to_string(opinions.by_second) +
         (opinions.told ? "" : "; the peer is told something else") + ": " +
         shown(policy, direction, asked, who);
}

}  // namespace connect_bridge::model
