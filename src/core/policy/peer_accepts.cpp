#include "core/policy/peer_accepts.hpp"

#include <algorithm>

namespace connect_bridge {
namespace {

constexpr std::size_t kNoRule = 0;  // of `deny`

// Calls `visit` with the rules of the entries with this name, until it returns true. Whether it
// did.
template <class Names, class Visit>
bool any_rule_of(const Names& names, std::string_view name, const Visit& visit) {
  const auto first =
      std::lower_bound(names.begin(), names.end(), typename Names::value_type{name, 0});
  for (auto it = first; it != names.end() && it->first == name; ++it)
    if (visit(it->second)) return true;
  return false;
}

}  // namespace

void PeerAccepts::Patterns::add(const std::vector<std::string>& texts, std::size_t rule) {
  for (const auto& text : texts) {
    if (!is_pattern(text)) continue;  // matches nothing
    if (!has_wildcard(text)) {
      names.emplace_back(text, rule);
    } else {
      wildcards.emplace_back(text);
      rules_of_wildcards.push_back(static_cast<std::uint16_t>(rule));
    }
  }
}

void PeerAccepts::Patterns::compile() {
  std::sort(names.begin(), names.end());
  if (!wildcards.empty()) compiled.emplace(std::exchange(wildcards, {}));
}

bool PeerAccepts::Patterns::match(std::string_view name, Hidden hidden,
                                  const RuleSet& rules) const {
  if (any_rule_of(names, name, [&](std::size_t rule) { return rules[rule]; })) return true;
  if (!compiled) return false;
  const auto matching = compiled->matching(name, hidden);
  if (matching.none()) return false;
  for (std::size_t i = 0; i < rules_of_wildcards.size(); ++i)
    if (matching[i] && rules[rules_of_wildcards[i]]) return true;
  return false;
}

PeerAccepts::PeerAccepts(Accepts list) : list_(std::move(list)) {
  const auto patterns_for = [&](OpenedBy by) -> Patterns& { return opened_by_[by]; };
  for (std::size_t i = 0; i < list_.rules.size(); ++i) {
    const AcceptedNames& rule = list_.rules[i];
    patterns_for(OpenedBy::kTopics).add(rule.topics, i);
    patterns_for(OpenedBy::kServices).add(rule.services, i);
    patterns_for(OpenedBy::kActions).add(rule.actions, i);
    patterns_for(OpenedBy::kParameters).add(rule.parameters, i);
    for (const auto& type : rule.types) types_.emplace_back(type, i);
    of_any_type_[i] = rule.types.empty();
  }
  deny_.add(list_.deny, kNoRule);
  for (auto& patterns : opened_by_.values) patterns.compile();
  deny_.compile();
  std::sort(types_.begin(), types_.end());
}

// `types` does not narrow parameters: a node has no type.
PeerAccepts::RuleSet PeerAccepts::rules_with_type(const Opening& opening) const {
  if (opening.by == OpenedBy::kParameters) return RuleSet().set();
  RuleSet rules = of_any_type_;
  any_rule_of(types_, opening.type, [&](std::size_t rule) {
    rules.set(rule);
    return false;
  });
  return rules;
}

bool PeerAccepts::denies(const Interface& what, const Opening& opening) const {
  return is_denied(what, opening, [&](std::string_view name) {
    return deny_.match(name, Hidden::kAny, RuleSet().set(kNoRule));
  });
}

bool PeerAccepts::takes(const Interface& what) const {
  const auto opening = opening_of(what);
  if (opening.by == OpenedBy::kNothing) return false;
  return opened_by_[opening.by].match(opening.name, Hidden::kSpelledOut,
                                      rules_with_type(opening)) &&
         !denies(what, opening);
}

bool PeerAccepts::takes_parameters() const {
  return std::any_of(list_.rules.begin(), list_.rules.end(),
                     [](const auto& rule) { return !rule.parameters.empty(); });
}

}  // namespace connect_bridge
