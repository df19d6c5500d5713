#include "config/explain_right.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "config/key_search.hpp"
#include "config/rule_reader.hpp"

namespace connect_bridge {
namespace {

using Patterns = std::vector<Pattern> Rule::*;

struct Key {
  const char* text;
  Patterns list;
};

Key key_of(OpenedBy what, Direction direction) {
  const bool out = direction == Direction::kExport;
  switch (what) {
    case OpenedBy::kServices:
      return out ? Key{"export_services", &Rule::export_services}
                 : Key{"import_services", &Rule::import_services};
    case OpenedBy::kActions:
      return out ? Key{"export_actions", &Rule::export_actions}
                 : Key{"import_actions", &Rule::import_actions};
    case OpenedBy::kParameters:
      return out ? Key{"export_parameters", &Rule::export_parameters}
                 : Key{"import_parameters", &Rule::import_parameters};
    default:
      return out ? Key{"export_topics", &Rule::export_topics}
                 : Key{"import_topics", &Rule::import_topics};
  }
}

const char* word_of(OpenedBy what) {
  switch (what) {
    case OpenedBy::kServices: return "service";
    case OpenedBy::kActions: return "action";
    case OpenedBy::kParameters: return "parameters of the node";
    default: return "topic";
  }
}

std::string list_text(const std::vector<std::string>& list) {
  return to_text(ParameterValue{list});
}

// The interface in question as the graph would show it; if no type was given, it has a type that no
// rule names.
struct Example {
  std::string name, type, action_type;
  InterfaceKind kind = InterfaceKind::kTopic;
  [[nodiscard]] Interface what() const { return {kind, name, type, action_type}; }
};

Example parameter_service(const std::string& node, const ParameterService& service) {
  return {fmt::format("{}/{}", node, service.token),
          std::string(service.type),
          {},
          InterfaceKind::kService};
}

Example example_of(const RightQuestion& question) {
  const auto typed = [&](const char* any) { return question.type.empty() ? any : question.type; };
  switch (question.what) {
    case OpenedBy::kServices:
      return {question.name, typed("any/srv/Type"), {}, InterfaceKind::kService};
    case OpenedBy::kActions:
      return {name_of_part(question.name, ActionPart::kCancelGoal),
              type_of_part({}, ActionPart::kCancelGoal), typed("any/action/Type"),
              InterfaceKind::kService};
    case OpenedBy::kParameters: return parameter_service(question.name, kParameterServices.front());
    default: return {question.name, typed("any/msg/Type"), {}, InterfaceKind::kTopic};
  }
}

// Explains one direction. Each fact is found by a policy with a single rule that has only the
// patterns in question, so the text cannot differ from what decide() does.
class Explainer {
 public:
  Explainer(const Config& config, const RightQuestion& question, Direction direction)
      : rules_(config.policy.rules()),
        config_(config),
        question_(question),
        direction_(direction),
        key_(key_of(question.what, direction)),
        example_(example_of(question)) {
    // Single parameter services of a node can be denied: one that is not denied is used as the
    // example.
    if (question.what != OpenedBy::kParameters) return;
    for (const auto& service : kParameterServices) {
      Example other = parameter_service(question.name, service);
      if (!is_denied(other)) {
        example_ = std::move(other);
        return;
      }
    }
  }

  [[nodiscard]] RightAnswer answer() {
    const bool denied = tell_denies();
    tell_matches(denied);
    if (!denied && !decided_) tell_nearest();
    if (decided_ && !denied) tell_peer();
    if (question_.what == OpenedBy::kParameters && !denied && decided_) tell_denied_services();
    const bool allowed = decided_ && !denied;
    std::string head = fmt::format("{}, {}: {}\n", direction_text(), question_.name,
                                   allowed ? verdict_ : "not allowed");
    return {head + body_, allowed};
  }

 private:
  [[nodiscard]] std::string direction_text() const {
    const bool out = direction_ == Direction::kExport;
    return fmt::format("{} (the {} {})", out ? "export" : "import", word_of(question_.what),
                       out ? "here, for the peer" : "of the peer, here");
  }
  void line(const std::string& text) { body_ += "  " + text + "\n"; }

  // Whether the rule, with nothing but these patterns, opens it.
  [[nodiscard]] bool opens(const Rule& rule, const Interface& what) const {
    return Policy({rule}).decide(direction_, what, question_.who).has_value();
  }
  [[nodiscard]] bool applies(const Rule& rule) const {
    Rule any;
    any.identities = rule.identities;
    any.groups = rule.groups;
    any.*key_.list = own_name();
    return opens(any, example_.what());
  }
  [[nodiscard]] std::vector<Pattern> own_name() const {
    auto pattern = Pattern::parse(question_.name);
    return pattern ? std::vector<Pattern>{std::move(pattern).value()} : std::vector<Pattern>{};
  }
  // The first pattern of the list that matches the name; null: none does.
  [[nodiscard]] const Pattern* match(const Rule& rule, Patterns list) const {
    for (const Pattern& pattern : rule.*list) {
      Rule one;
      one.*key_.list = {pattern};
      if (opens(one, example_.what())) return &pattern;
    }
    return nullptr;
  }
  [[nodiscard]] const Pattern* deny_of(const Rule& rule, const Interface& what) const {
    for (const Pattern& pattern : rule.deny) {
      Rule one;
      one.*key_.list = own_name();
      one.deny = {pattern};
      if (!opens(one, what)) return &pattern;
    }
    return nullptr;
  }
  [[nodiscard]] bool is_denied(const Example& what) const {
    return std::any_of(rules_.begin(), rules_.end(), [&](const Rule& rule) {
      return applies(rule) && deny_of(rule, what.what()) != nullptr;
    });
  }
  [[nodiscard]] bool type_fits(const Rule& rule) const {
    return rule.types.empty() || question_.what == OpenedBy::kParameters ||
           std::find(rule.types.begin(), rule.types.end(), question_.type) != rule.types.end();
  }
  [[nodiscard]] static std::string for_whom(const Rule& rule) {
    std::string text;
    if (!rule.identities.empty()) text += "identities " + list_text(rule.identities);
    if (!rule.groups.empty())
      text += (text.empty() ? "groups " : " or groups ") + list_text(rule.groups);
    return text;
  }
  // The default rules of a client are not keys of a file.
  [[nodiscard]] std::string where(const Rule& rule, const char* key, const Pattern& pattern) const {
    if (config_.default_rules)
      return fmt::format("the default rules of a client ({}: \"{}\")", key, pattern.text());
    return fmt::format("rule \"{}\" (rule.{}.{}: \"{}\")", rule.name, rule.name, key,
                       pattern.text());
  }

  bool tell_denies() {
    bool denied = false;
    for (const Rule& rule : rules_) {
      const Pattern* pattern = deny_of(rule, example_.what());
      if (pattern == nullptr) continue;
      if (applies(rule)) {
        line(
            fmt::format("denied by {}; a deny wins over all rules", where(rule, "deny", *pattern)));
        denied = true;
      } else {
        line(fmt::format("{} denies it, but only for {}", where(rule, "deny", *pattern),
                         for_whom(rule)));
      }
    }
    return denied;
  }

  void tell_matches(bool denied) {
    for (const Rule& rule : rules_) {
      const Pattern* pattern = match(rule, key_.list);
      if (pattern == nullptr) continue;
      const std::string at = where(rule, key_.text, *pattern);
      if (!applies(rule)) {
        line(fmt::format("{} matches, but is only for {}", at, for_whom(rule)));
      } else if (!type_fits(rule) && !question_.type.empty()) {
        line(fmt::format("{} matches, but is only for the types {}", at, list_text(rule.types)));
      } else if (decided_ && !open_types_) {
        line(fmt::format("{} matches, too; it comes later, so its treatment is not used", at));
      } else if (!type_fits(rule)) {
        line(fmt::format("{} by {}, if its type is one of {}",
                         denied ? "would be allowed" : "allowed", at, list_text(rule.types)));
        decided_ = open_types_ = true;
        verdict_ = "allowed for some types (--type tells which)";
      } else {
        line(fmt::format("{}{} by {}", denied ? "would be allowed" : "allowed",
                         open_types_ ? " for other types" : "", at));
        decided_ = true;
        open_types_ = false;
        verdict_ = "allowed";
      }
    }
  }

  // If nothing matches: shows the same name elsewhere, or the most similar pattern.
  void tell_nearest() {
    bool told = false;
    for (const Rule& rule : rules_) {
      for (const OpenedBy what :
           {OpenedBy::kTopics, OpenedBy::kServices, OpenedBy::kActions, OpenedBy::kParameters}) {
        for (const Direction direction : {Direction::kExport, Direction::kImport}) {
          if (what == question_.what && direction == direction_) continue;
          const Key other = key_of(what, direction);
          const Pattern* pattern = match(rule, other.list);
          if (pattern == nullptr) continue;
          line(fmt::format("{} matches the name, but does not apply here",
                           where(rule, other.text, *pattern)));
          told = true;
        }
      }
    }
    const auto [rule, pattern] = nearest();
    if (pattern != nullptr)
      line(fmt::format("the nearest is {}", where(*rule, key_.text, *pattern)));
    if (!told && body_.empty()) line(fmt::format("no rule in use has {}", key_.text));
  }

  [[nodiscard]] std::pair<const Rule*, const Pattern*> nearest() const {
    std::pair<const Rule*, const Pattern*> best{nullptr, nullptr};
    std::size_t least = 0;
    for (const Rule& rule : rules_) {
      for (const Pattern& pattern : rule.*key_.list) {
        if (match_one(pattern)) continue;  // shown already
        const std::size_t here = edit_distance(pattern.text(), question_.name);
        if (best.second != nullptr && here >= least) continue;
        best = {&rule, &pattern};
        least = here;
      }
    }
    return best;
  }
  [[nodiscard]] bool match_one(const Pattern& pattern) const {
    Rule one;
    one.*key_.list = {pattern};
    return opens(one, example_.what());
  }

  void tell_denied_services() {
    for (const auto& service : kParameterServices) {
      const Example example = parameter_service(question_.name, service);
      for (const Rule& rule : rules_)
        if (const Pattern* pattern = deny_of(rule, example.what());
            pattern != nullptr && applies(rule))
          line(fmt::format("but not {}: denied by {}", service.token,
                           where(rule, "deny", *pattern)));
    }
  }

  void tell_peer() {
    const bool out = direction_ == Direction::kExport;
    const Key other = key_of(question_.what, out ? Direction::kImport : Direction::kExport);
    std::string by_default;
    if (config_.role == Role::kServer) {
      const Direction theirs = out ? Direction::kImport : Direction::kExport;
      const bool has =
          Policy({default_rule()}).decide(theirs, example_.what(), Identity{}).has_value();
      by_default =
          has ? "; those of a client without rules do" : "; those of a client without rules do not";
    }
    line(fmt::format("the peer's rules must have it in {}{}", other.text, by_default));
  }

  const std::vector<Rule>& rules_;
  const Config& config_;
  const RightQuestion& question_;
  const Direction direction_;
  const Key key_;
  Example example_;
  bool decided_ = false;
  bool open_types_ = false;  // allowed so far for some types only
  std::string verdict_;
  std::string body_;
};

}  // namespace

std::string problem_of(const RightQuestion& question) {
  const std::string& name = question.name;
  if (!is_canonical_name(name)) return "an absolute name, as /camera/image";
  if (has_action_token(name))
    return "the name of the action itself (--action), not of a part of it";
  if (question.what == OpenedBy::kTopics && name == kParameterEvents)
    return "the name of a node (--parameters): rules for parameters open this topic";
  if (question.what == OpenedBy::kServices && is_parameter_service_name(name))
    return "the name of the node (--parameters): rules for parameters open this service";
  const std::string& type = question.type;
  if (type.empty()) return {};
  switch (question.what) {
    case OpenedBy::kTopics: return is_topic_type(type) ? "" : "a type as std_msgs/msg/String";
    case OpenedBy::kServices: return is_service_type(type) ? "" : "a type as std_srvs/srv/SetBool";
    case OpenedBy::kActions: return is_action_type(type) ? "" : "a type as p/action/Fibonacci";
    default: return "no --type: a node has none";
  }
}

RightAnswer explain_right(const Config& config, const RightQuestion& question) {
  RightAnswer all;
  for (const Direction direction : {Direction::kExport, Direction::kImport}) {
    if (question.direction && *question.direction != direction) continue;
    const RightAnswer one = Explainer(config, question, direction).answer();
    all.text += one.text;
    all.allowed = all.allowed || one.allowed;
  }
  return all;
}

}  // namespace connect_bridge
