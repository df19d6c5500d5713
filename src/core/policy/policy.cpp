#include "core/policy/policy.hpp"

#include <algorithm>
#include <utility>

namespace connect_bridge {
namespace {

bool contains(const std::vector<std::string>& list, std::string_view value) {
  return std::find(list.begin(), list.end(), value) != list.end();
}

bool applies_to(const Rule& rule, const Identity& who) {
  return is_for(rule.identities, rule.groups, who);
}

template <class Fits>
const Pattern* first_of(const std::vector<Pattern>& patterns, Fits&& fits) {
  const auto found = std::find_if(patterns.begin(), patterns.end(), fits);
  return found == patterns.end() ? nullptr : &*found;
}

// `types` does not narrow parameters: a node has no type.
bool type_allowed(const std::vector<std::string>& types, const Opening& opening) {
  return types.empty() || opening.by == OpenedBy::kParameters || contains(types, opening.type);
}

}  // namespace

bool is_for(const std::vector<std::string>& identities, const std::vector<std::string>& groups,
            const Identity& who) {
  if (identities.empty() && groups.empty()) return true;
  if (!who.name.empty() && contains(identities, who.name)) return true;
  return std::any_of(who.groups.begin(), who.groups.end(),
                     [&](const std::string& group) { return contains(groups, group); });
}

std::optional<Decision> Policy::decide(Direction direction, const Interface& what,
                                       const Identity& who, PolicyTrace* trace) const {
  // No pattern opens an invalid name or type.
  const auto opening = opening_of(what);
  if (opening.by == OpenedBy::kNothing) return std::nullopt;
  const Rule* first = nullptr;
  bool denied = false;
  for (const auto& rule : rules_) {
    RuleTrace said{&rule, applies_to(rule, who)};
    if (!said.applies && !trace) continue;
    said.denied_by = first_of(rule.deny, [&](const Pattern& pattern) {
      return is_denied(what, opening, [&](std::string_view name) { return pattern.covers(name); });
    });
    // Also behind the first rule that allows it: a deny wins wherever it stands, so the loop goes
    // on to the last rule.
    denied = denied || (said.applies && said.denied_by);  // mutant: deny
    if (denied && !trace) return std::nullopt;
    if (first && !trace) continue;
    said.type_fits = type_allowed(rule.types, opening);
    said.opened_by = first_of(rule.opens[direction][opening.by], [&](const Pattern& pattern) {
      return pattern.matches(opening.name);
    });
    if (!first && said.applies && said.type_fits && said.opened_by) first = &rule;
    if (trace) trace->push_back(said);
  }
  if (denied || !first) return std::nullopt;
  return Decision{first->name, first->treatment};
}

std::optional<Decision> Policy::decide(Direction direction, InterfaceKind kind,
                                       std::string_view name, std::string_view type,
                                       const Identity& who, PolicyTrace* trace) const {
  if (kind != InterfaceKind::kAction) return decide(direction, {kind, name, type}, who, trace);
  // A whole action is decided as one of its parts, since all five have the same rights. This part's
  // own type says nothing of the action's, so that is given beside it.
  return decide(direction,
                {InterfaceKind::kService, name_of_part(name, ActionPart::kCancelGoal),
                 type_of_part(type, ActionPart::kCancelGoal), type},
                who, trace);
}

std::optional<Decision> Policy::decide_parameter_events(Direction direction, std::string_view type,
                                                        const Identity& who) const {
  if (type != kParameterEventType) return std::nullopt;
  const Rule* first = nullptr;
  for (const auto& rule : rules_) {
    if (!applies_to(rule, who)) continue;
    // A deny of the topic by its own name, from any rule, ends it for all nodes.
    for (const auto& pattern : rule.deny) {
      if (pattern.covers(kParameterEvents)) return std::nullopt;
    }
    if (first == nullptr && !rule.opens[direction][OpenedBy::kParameters].empty()) first = &rule;
  }
  if (first == nullptr) return std::nullopt;
  return Decision{first->name, first->treatment};
}

Accepts Policy::accepts(const Identity& who) const {
  const auto texts = [](const std::vector<Pattern>& patterns) {
    std::vector<std::string> result;
    for (const auto& pattern : patterns) result.push_back(pattern.text());
    return result;
  };
  Accepts result;
  for (const auto& rule : rules_) {
    if (!applies_to(rule, who)) continue;
    for (const auto& pattern : rule.deny) result.deny.push_back(pattern.text());
    AcceptedNames names;
    const auto& imports = rule.opens[Direction::kImport];
    names.topics = texts(imports[OpenedBy::kTopics]);
    names.services = texts(imports[OpenedBy::kServices]);
    names.actions = texts(imports[OpenedBy::kActions]);
    names.parameters = texts(imports[OpenedBy::kParameters]);
    if (names.topics.empty() && names.services.empty() && names.actions.empty() &&
        names.parameters.empty()) {
      continue;
    }
    names.types = rule.types;
    result.rules.push_back(std::move(names));
  }
  return result;
}

}  // namespace connect_bridge
