#include "model/rule_opinions.hpp"

#include <utility>

namespace connect_bridge::model {
namespace {

std::string shown(const Policy& policy, Direction direction, const Asked& asked,
                  const Identity& who) {
  std::string text = direction == Direction::kExport ? "export " : "import ";
  text += asked.name + " [" + asked.type + "] for " + who.name;
  for (const auto& group : who.groups) text += " +" + group;
  for (const Rule& rule : policy.rules()) {
    text += "\n  " + rule.name;
    for (const auto& [key, list] : {std::pair{"export_topics", &rule.export_topics},
                                    {"import_topics", &rule.import_topics},
                                    {"export_services", &rule.export_services},
                                    {"import_services", &rule.import_services},
                                    {"export_actions", &rule.export_actions},
                                    {"import_actions", &rule.import_actions},
                                    {"export_parameters", &rule.export_parameters},
                                    {"import_parameters", &rule.import_parameters},
                                    {"deny", &rule.deny}})
      for (const Pattern& pattern : *list) text += std::string(" ") + key + ":" + pattern.text();
    for (const auto& [key, list] : {std::pair{"types", &rule.types},
                                    {"identities", &rule.identities},
                                    {"groups", &rule.groups}})
      for (const auto& word : *list) text += std::string(" ") + key + ":" + word;
  }
  return text;
}

}  // namespace

RuleOpinions opinions_of(const Policy& policy, const Accepts& accepts, Direction direction,
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
      direction == Direction::kExport || accepted_by(accepts, asked.what()) == decided.has_value();
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
