// The rules against the second opinion on them (sim/rights.hpp), which shares no code with them.
//
//   rule_tuples [--tuples N] [--seed S]
//
// A tuple is a set of rules, a peer with its groups, a direction, and an interface with a kind, a
// name and a type. Whether it is allowed, and by which rule, must be the same for both; and
// `accepts` must allow exactly what the importing side allows.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "model/rule_opinions.hpp"
#include "sim/rights.hpp"
#include "sim/rng.hpp"

namespace {

using namespace connect_bridge;  // NOLINT: a program of one file
using model::Asked;
using model::opinions_of;
using model::RuleOpinions;
using sim::Rng;
using Strings = std::vector<std::string>;

constexpr std::uint64_t kTuplesOfAPolicy = 50;
const Strings kTokens = {"a", "b", "ab", "aab", "_h", "_ab", "a_b"};
const Strings kPatternTokens = {"a",  "b",  "ab", "*",   "**",  "**",  "a*",
                                "*b", "_*", "_h", "a*b", "*a*", "a_b", "*_*"};
const Strings kTopicTypes = {"p/msg/A", "p/msg/B", "p/srv/C_Event"};
const Strings kServiceTypes = {"p/srv/C", "p/srv/D"};
const Strings kActionTypes = {sim::kActionType, "p/action/Do"};
const Strings kAllTypes = {"p/msg/A",       "p/msg/B",        "p/srv/C",    "p/srv/D",
                           "p/srv/C_Event", sim::kActionType, "p/action/Do"};
const Strings kParameterServices = {"describe_parameters", "get_parameter_types",
                                    "get_parameters",      "list_parameters",
                                    "set_parameters",      "set_parameters_atomically"};
const Strings kParameterTypes = {"DescribeParameters", "GetParameterTypes",
                                 "GetParameters",      "ListParameters",
                                 "SetParameters",      "SetParametersAtomically"};
const Strings kPeople = {"anna", "bert", "ops"};

std::string name(Rng& rng, const Strings& tokens) {
  std::string text;
  for (std::uint64_t n = 1 + rng.below(4); n > 0; --n) text += "/" + rng.pick(tokens);
  return text;
}

std::vector<Pattern> patterns(Rng& rng, unsigned permille) {
  std::vector<Pattern> result;
  while (rng.chance(permille)) {
    std::string text = name(rng, kPatternTokens);
    if (rng.chance(60)) text += "/" + rng.pick(kParameterServices);
    if (rng.chance(60)) text += "/_action/" + std::string(rng.chance(500) ? "*" : "send_goal");
    if (auto pattern = Pattern::parse(text)) result.push_back(std::move(pattern).value());
  }
  return result;
}

Strings some(Rng& rng, const Strings& of, unsigned permille) {
  Strings result;
  while (rng.chance(permille)) result.push_back(rng.pick(of));
  return result;
}

Rule random_rule(Rng& rng, std::uint32_t number) {
  Rule rule;
  rule.name = "rule" + std::to_string(number);
  rule.treatment.calls_max = number;
  for (auto* list : {&rule.opens[Direction::kExport][OpenedBy::kTopics],
                     &rule.opens[Direction::kImport][OpenedBy::kTopics],
                     &rule.opens[Direction::kExport][OpenedBy::kServices],
                     &rule.opens[Direction::kImport][OpenedBy::kServices],
                     &rule.opens[Direction::kExport][OpenedBy::kActions],
                     &rule.opens[Direction::kImport][OpenedBy::kActions],
                     &rule.opens[Direction::kExport][OpenedBy::kParameters],
                     &rule.opens[Direction::kImport][OpenedBy::kParameters]})
    *list = patterns(rng, 650);
  rule.deny = patterns(rng, 150);
  rule.types = some(rng, kAllTypes, rng.chance(300) ? 600 : 0);
  rule.identities = some(rng, kPeople, rng.chance(300) ? 500 : 0);
  rule.groups = some(rng, kPeople, rng.chance(300) ? 500 : 0);
  return rule;
}

Asked random_interface(Rng& rng) {
  Asked asked;
  asked.name = name(rng, kTokens);
  switch (rng.below(4)) {
    case 0: asked.type = rng.pick(kTopicTypes); break;
    case 1:
      asked.kind = InterfaceKind::kService;
      asked.type = rng.pick(kServiceTypes);
      break;
    case 2: {
      const auto part = kActionParts[rng.below(kActionParts.size())];
      const bool same = type_of_part("x", part) == type_of_part("y", part);
      asked.action_type = same ? sim::kActionType : rng.pick(kActionTypes);
      asked.kind = kind_of(part);
      asked.type = type_of_part(asked.action_type, part);
      asked.name = name_of_part(asked.name, part);
      break;
    }
    default: {
      const auto service = rng.below(kParameterServices.size());
      // Now and then a service that only looks like one of a node's parameters.
      const auto type = rng.chance(50) ? rng.below(kParameterTypes.size()) : service;
      asked.kind = InterfaceKind::kService;
      asked.name += "/" + kParameterServices[service];
      asked.type = "rcl_interfaces/srv/" + kParameterTypes[type];
    }
  }
  return asked;
}

struct Counts {
  std::uint64_t tuples = 0, allowed = 0, differ = 0;
};

void ask(Rng& rng, const Policy& policy, const Identity& who, const PeerAccepts& accepts,
         Counts& counts) {
  const Asked asked = random_interface(rng);
  const Direction direction = rng.chance(500) ? Direction::kExport : Direction::kImport;
  const RuleOpinions opinions = opinions_of(policy, accepts, direction, asked, who);
  ++counts.tuples;
  if (opinions.by != 0) ++counts.allowed;
  if (opinions.agree() || ++counts.differ > 5) return;
  std::fprintf(stderr, "%s\n", to_text(opinions, policy, direction, asked, who).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  std::uint64_t tuples = 300'000;
  std::uint64_t seed = 1;
  for (int i = 1; i < argc; i += 2) {
    const std::string_view option = argv[i];
    if (i + 1 == argc || (option != "--tuples" && option != "--seed")) {
      std::fprintf(stderr, "usage: rule_tuples [--tuples N] [--seed S]\n");
      return 2;
    }
    (option == "--seed" ? seed : tuples) = std::strtoull(argv[i + 1], nullptr, 10);
  }
  Rng rng(seed);
  Counts counts;
  while (counts.tuples < tuples) {
    std::vector<Rule> rules;
    for (std::uint32_t n = static_cast<std::uint32_t>(rng.below(5)); n > 0; --n)
      rules.push_back(random_rule(rng, static_cast<std::uint32_t>(rules.size() + 1)));
    const Policy policy(std::move(rules));
    const Identity who{rng.chance(200) ? "" : rng.pick(kPeople), some(rng, kPeople, 300)};
    const PeerAccepts accepts(policy.accepts(who));
    for (std::uint64_t i = 0; i < kTuplesOfAPolicy; ++i) ask(rng, policy, who, accepts, counts);
  }
  std::printf("%llu tuples, %llu allowed, %llu differ\n",
              static_cast<unsigned long long>(counts.tuples),
              static_cast<unsigned long long>(counts.allowed),
              static_cast<unsigned long long>(counts.differ));
  // A test with refusals only would be useless.
  return counts.differ == 0 && counts.allowed * 20 > counts.tuples ? 0 : 1;
}
