#include "config/rule_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "config/key_search.hpp"
#include "config/rule_rows.hpp"
#include "config/syntax.hpp"
#include "core/wire/control.hpp"

namespace connect_bridge {
namespace {

// This period is fine enough for the timers of nodes, and cheap: the messages cross no link.
constexpr Duration kClockPublishPeriod = std::chrono::milliseconds(10);

bool matches(const std::vector<Pattern>& patterns, std::string_view name) {
  return std::any_of(patterns.begin(), patterns.end(),
                     [&](const Pattern& pattern) { return pattern.matches(name); });
}

// The core makes /clock from the link's clock offset if a rule has `clock: publish`. The peer's own
// /clock in addition would be a second, late time. The /clock that we publish must not be exported
// back.
Rule clock_rule(const Rule& from) {
  Rule rule;
  rule.name = from.name + ".clock";  // a dot: no rule of the operator has this name
  rule.identities = from.identities;
  rule.groups = from.groups;
  rule.deny = syntax::parse_patterns({"/clock"});
  return rule;
}

std::string key_of(const std::string& rule, std::string_view suffix) {
  return fmt::format("rule.{}.{}", rule, suffix);
}

Rule read_rule(const CheckedValues& values, const std::string& name, bool is_robot) {
  Rule rule;
  rule.name = name;
  values.store(rule);
  auto& own = rule.opens[is_robot ? Direction::kExport : Direction::kImport][OpenedBy::kParameters];
  for (auto& pattern : syntax::parse_patterns(values.list(key_of(name, "parameters"))))
    own.push_back(std::move(pattern));
  return rule;
}

// An invalid list counts too: its own problem is already reported.
bool allows_or_denies(const CheckedValues& values, const std::string& rule) {
  const auto& table = key_table();
  return std::any_of(table.begin(), table.end(), [&](const KeySpec& spec) {
    const std::string right = key_of(spec, rule);
    return spec.section == kRuleRights && spec.syntax == syntax::check_pattern &&
           values.given(right) && !(values.valid(right) && values.list(right).empty());
  });
}

void check_clock(const CheckedValues& values, const Rule& rule, RuleSet& set,
                 std::vector<Problem>& problems) {
  const std::string clock = key_of(rule.name, "clock");
  const std::string imports = key_of(rule.name, "import_topics");
  if (values.text(clock) != "publish") return;
  if (values.valid(imports) &&
      !matches(rule.opens[Direction::kImport][OpenedBy::kTopics], "/clock")) {
    problems.push_back({clock, "\"publish\"", "/clock among import_topics of this rule"});
  } else if (!values.given(imports)) {
    problems.push_back({clock, "\"publish\"", "import_topics: [/clock] too"});
  }
  if (set.clock_publish_period != Duration::zero()) {
    problems.push_back({clock, "\"publish\"", "only one rule with clock: publish"});
  }
  set.clock_publish_period = kClockPublishPeriod;
}

void check_listed(const CheckedValues& values, const std::vector<std::string>& names, ReadAt moment,
                  std::vector<Problem>& problems, std::vector<std::string>& warnings) {
  std::vector<std::string> undefined, unlisted;
  for (const std::string& name : names)
    if (!values.rules().contains(name)) undefined.push_back(name);
  for (const std::string& name : values.rules())
    if (std::find(names.begin(), names.end(), name) == names.end()) unlisted.push_back(name);
  // One fault with two ends.
  const bool is_renamed = undefined.size() == 1 && unlisted.size() == 1;
  for (const std::string& name : undefined)
    problems.push_back(
        {"rules", to_text(name),
         is_renamed ? fmt::format("a rule that is defined: did you mean {}?", unlisted.front())
                    : fmt::format("a rule that is defined, e.g. by rule.{}.import_topics", name)});
  if (is_renamed) return;
  for (const std::string& name : unlisted) {
    if (moment == ReadAt::kStart) {
      problems.push_back({"rule." + name, "", "its name in `rules`, else it has no effect"});
    } else {
      warnings.push_back(fmt::format("rule.{0}: has no effect, `rules` does not name {0}", name));
    }
  }
}

// A misspelt type in a rule would silently forward nothing.
void check_types(const Rule& rule, const Surroundings& around, std::vector<Problem>& problems) {
  if (!around.installed) return;
  for (const std::string& type : rule.types) {
    if (type.find("/msg/") == std::string::npos || around.installed(type)) continue;
    problems.push_back({key_of(rule.name, "types"), type,
                        fmt::format("a message type that is installed here (package {})",
                                    type.substr(0, type.find('/')))});
  }
}

// The key of the announced list of patterns that has the most wildcards.
std::string key_with_most_wildcards(const CheckedValues& values, const std::vector<Rule>& rules) {
  std::string most;
  std::ptrdiff_t count = 0;
  const auto look = [&](const Rule& rule, std::string_view right,
                        const std::vector<Pattern>& patterns) {
    const auto here = std::count_if(patterns.begin(), patterns.end(),
                                    [](const Pattern& p) { return has_wildcard(p.text()); });
    if (here <= count) return;
    count = here;
    most = key_of(rule.name, right);
  };
  for (const Rule& rule : rules) {
    for (const OpenedBy kind : kKindsOfRules) {
      const std::string right = right_key(Direction::kImport, kind);
      const bool by_another_key =
          kind == OpenedBy::kParameters && !values.given(key_of(rule.name, right));
      look(rule, by_another_key ? "parameters" : right, rule.opens[Direction::kImport][kind]);
    }
    look(rule, "deny", rule.deny);
  }
  return most;
}

// Import patterns are announced to each peer, and a peer refuses more than the limits
// (docs/protocol.md section 12). The count assumes that all rules are for one peer: groups are
// known only at the login.
void check_announced(const CheckedValues& values, std::vector<Rule> rules,
                     std::vector<Problem>& problems) {
  const std::string most_wildcards = key_with_most_wildcards(values, rules);
  for (Rule& rule : rules) {
    rule.identities.clear();
    rule.groups.clear();
  }
  Accepts all = Policy(std::move(rules)).accepts({});
  all.message_bytes_max = UINT32_MAX;
  const auto at_most = [&](std::size_t count, std::size_t max, std::string_view of_what,
                           const std::string& key = "rules") {
    if (count > max)
      problems.push_back(
          {key, "", fmt::format("at most {} {}; there are {}", max, of_what, count)});
    return count <= max;
  };
  const AcceptsSize size = size_of(all);
  if (at_most(size.entries, kAcceptEntriesMax,
              "import patterns, parameters, deny patterns and types in all rules together") &&
      at_most(size.wildcards, kWildcardsMax,
              "patterns with * in what all rules import and deny together", most_wildcards) &&
      at_most(size.wildcard_bytes, kWildcardBytesMax,
              "characters behind the first * of each pattern, in what all rules import and deny "
              "together",
              most_wildcards) &&
      at_most(all.rules.size(), kAcceptRulesMax, "rules that import something")) {
    at_most(encode(all).size(), kControlBytesMax,
            "bytes of import patterns, parameters, deny patterns and types in all rules together");
  }
}

}  // namespace

Rule default_rule() {
  Rule rule;
  rule.name = "default";
  rule.opens[Direction::kExport][OpenedBy::kTopics] = syntax::parse_patterns({"/**"});
  // Hidden names are included if the peer's rules spell them out, with at most two hidden parts.
  const std::vector<std::string> all = {"/**", "/**/_*", "/**/_*/**", "/**/_*/**/_*",
                                        "/**/_*/**/_*/**"};
  auto& imports = rule.opens[Direction::kImport];
  imports[OpenedBy::kTopics] = imports[OpenedBy::kServices] = syntax::parse_patterns(all);
  imports[OpenedBy::kActions] = imports[OpenedBy::kParameters] = syntax::parse_patterns({"/**"});
  // Every node publishes /rosout. After a merge with the local one, nobody could identify the
  // sender of a message.
  rule.deny = syntax::parse_patterns({"/rosout"});  // mutant: rosout
  rule.treatment.compression.automatic = true;      // the default of every rule
  return rule;
}

RuleSet read_rules(const CheckedValues& values, bool is_robot, ReadAt moment,
                   const Surroundings& around, std::vector<Problem>& problems,
                   std::vector<std::string>& warnings) {
  RuleSet set;
  const bool listed = !values.given("rules") || values.valid("rules");
  const std::vector<std::string> names = values.list("rules");
  if (listed) check_listed(values, names, moment, problems, warnings);
  std::optional<Rule> clock;
  for (const std::string& name : names) {
    if (!values.rules().contains(name)) continue;
    set.rules.push_back(read_rule(values, name, is_robot));
    if (!allows_or_denies(values, name)) {
      problems.push_back({"rule." + name, "",
                          "at least one of export_topics, import_topics, export_services, ...: "
                          "this rule allows nothing"});
    }
    check_clock(values, set.rules.back(), set, problems);
    if (values.text(key_of(name, "clock")) == "publish") clock = clock_rule(set.rules.back());
  }
  if (clock) {
    set.clock_identities = clock->identities;
    set.clock_groups = clock->groups;
    set.rules.push_back(std::move(*clock));
  }
  for (const Rule& rule : set.rules) check_types(rule, around, problems);
  check_announced(values, set.rules, problems);
  if (!names.empty() || !values.rules().empty()) return set;
  if (!is_robot) {
    set.rules.push_back(default_rule());
    set.defaults = true;
  } else {
    warnings.push_back(
        "rules: there are none, so no peer may exchange anything with this robot. "
        "docs/config.md shows how to write one");
  }
  return set;
}

}  // namespace connect_bridge
