#include "config/explain_right.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "config/key_search.hpp"
#include "config/rule_reader.hpp"
#include "config/rule_rows.hpp"

namespace connect_bridge {
namespace {

const char* word_of(OpenedBy what) {
  switch (what) {
    case OpenedBy::kServices: return "service";
    case OpenedBy::kActions: return "action";
    case OpenedBy::kParameters: return "parameters of the node";
    default: return "topic";
  }
}

std::string shown_list(const std::vector<std::string>& list) {
  return to_text(ParameterValue{list});
}

// Explains one direction by the trace of Policy::decide().
class Explainer {
 public:
  Explainer(const Config& config, const RightQuestion& question, Direction direction)
      : config_(config),
        question_(question),
        direction_(direction),
        key_(right_key(direction, question.what)),
        trace_(ask(config.policy, direction).trace) {}

  [[nodiscard]] RightAnswer answer() {
    const bool denied = tell_denies();
    tell_matches(denied);
    if (!denied && !decided_) tell_nearest();
    if (decided_ && !denied) tell_peer();
    if (decided_ && !denied) tell_lossy();
    if (question_.what == OpenedBy::kParameters && !denied && decided_) tell_denied_services();
    const bool allowed = decided_ && !denied;
    std::string head = fmt::format("{}, {}: {}\n", direction_text(), question_.name,
                                   allowed ? verdict_ : "not allowed");
    return {head + body_, allowed};
  }

 private:
  struct Verdict {
    bool allowed = false;
    PolicyTrace trace;
  };

  [[nodiscard]] std::string direction_text() const {
    const bool out = direction_ == Direction::kExport;
    return fmt::format("{} (the {} {})", out ? "export" : "import", word_of(question_.what),
                       out ? "here, for the peer" : "of the peer, here");
  }
  void line(const std::string& text) { body_ += "  " + text + "\n"; }

  [[nodiscard]] Verdict ask(const Policy& policy, Direction direction, InterfaceKind kind,
                            const std::string& name, std::string_view type) const {
    Verdict verdict;
    verdict.allowed =
        policy.decide(direction, kind, name, type, question_.who, &verdict.trace).has_value();
    return verdict;
  }
  // A placeholder that no rule names stands for a type that was not given. The parameters of a node
  // count as open as long as one of their services is.
  [[nodiscard]] Verdict ask(const Policy& policy, Direction direction) const {
    const auto typed = [&](std::string_view any) {
      return question_.type.empty() ? any : std::string_view(question_.type);
    };
    const std::string& name = question_.name;
    switch (question_.what) {
      case OpenedBy::kServices:
        return ask(policy, direction, InterfaceKind::kService, name, typed("any/srv/Type"));
      case OpenedBy::kActions:
        return ask(policy, direction, InterfaceKind::kAction, name, typed("any/action/Type"));
      case OpenedBy::kParameters: break;
      default: return ask(policy, direction, InterfaceKind::kTopic, name, typed("any/msg/Type"));
    }
    Verdict verdict;
    for (const auto& service : kParameterServices) {
      verdict = ask_parameter_service(policy, direction, service);
      if (!is_denied(verdict.trace)) break;
    }
    return verdict;
  }
  [[nodiscard]] Verdict ask_parameter_service(const Policy& policy, Direction direction,
                                              const ParameterService& service) const {
    return ask(policy, direction, InterfaceKind::kService,
               fmt::format("{}/{}", question_.name, service.token), service.type);
  }
  [[nodiscard]] static bool denies(const RuleTrace& said) { return said.applies && said.denied_by; }
  [[nodiscard]] static bool is_denied(const PolicyTrace& trace) {
    return std::any_of(trace.begin(), trace.end(), denies);
  }

  [[nodiscard]] static std::string for_whom(const Rule& rule) {
    std::string text;
    if (!rule.identities.empty()) text += "identities " + shown_list(rule.identities);
    if (!rule.groups.empty())
      text += (text.empty() ? "groups " : " or groups ") + shown_list(rule.groups);
    return text;
  }
  // Default rules have no keys in a file.
  [[nodiscard]] std::string where(const Rule& rule, const std::string& key,
                                  const Pattern& pattern) const {
    if (config_.default_rules)
      return fmt::format("the default rules ({}: \"{}\")", key, pattern.text());
    return fmt::format("rule \"{}\" (rule.{}.{}: \"{}\")", rule.name, rule.name, key,
                       pattern.text());
  }

  bool tell_denies() {
    for (const RuleTrace& said : trace_) {
      if (!said.denied_by) continue;
      const std::string at = where(*said.rule, "deny", *said.denied_by);
      line(said.applies ? fmt::format("denied by {}; a deny wins over all rules", at)
                        : fmt::format("{} denies it, but only for {}", at, for_whom(*said.rule)));
    }
    return is_denied(trace_);
  }

  void tell_matches(bool denied) {
    for (const RuleTrace& said : trace_) {
      if (!said.opened_by) continue;
      const Rule& rule = *said.rule;
      const std::string at = where(rule, key_, *said.opened_by);
      if (!said.applies) {
        line(fmt::format("{} matches, but is only for {}", at, for_whom(rule)));
      } else if (!said.type_fits && !question_.type.empty()) {
        line(fmt::format("{} matches, but is only for the types {}", at, shown_list(rule.types)));
      } else if (decided_ && !open_types_) {
        line(fmt::format("{} matches, too; it comes later, so its treatment is not used", at));
      } else if (!said.type_fits) {
        line(fmt::format("{} by {}, if its type is one of {}",
                         denied ? "would be allowed" : "allowed", at, shown_list(rule.types)));
        decided_ = open_types_ = true;
        deciding_ = &rule;
        verdict_ = "allowed for some types (--type tells which)";
      } else {
        line(fmt::format("{}{} by {}", denied ? "would be allowed" : "allowed",
                         open_types_ ? " for other types" : "", at));
        decided_ = true;
        open_types_ = false;
        verdict_ = "allowed";
        deciding_ = &rule;
      }
    }
  }

  // Shows rules that match the name elsewhere, and the most similar pattern, if nothing matches.
  void tell_nearest() {
    bool explained = false;
    for (const Rule& rule : config_.policy.rules()) {
      for (const OpenedBy what : kKindsOfRules) {
        for (const Direction direction : {Direction::kExport, Direction::kImport}) {
          if (what == question_.what && direction == direction_) continue;
          const auto& patterns = rule.opens[direction][what];
          const auto found = std::find_if(patterns.begin(), patterns.end(), [&](const auto& one) {
            return one.matches(question_.name);
          });
          if (found == patterns.end()) continue;
          line(fmt::format("{} matches the name, but is for {}",
                           where(rule, right_key(direction, what), *found),
                           what == question_.what ? "the other direction" : "another kind"));
          explained = true;
        }
      }
    }
    const auto [rule, pattern] = nearest();
    if (pattern != nullptr) line(fmt::format("the nearest is {}", where(*rule, key_, *pattern)));
    if (explained || !body_.empty()) return;
    const auto& rules = config_.policy.rules();
    const bool has_key = std::any_of(rules.begin(), rules.end(), [&](const Rule& one) {
      return !one.opens[direction_][question_.what].empty();
    });
    line(fmt::format("no rule in use {} {}", has_key ? "names it in" : "has", key_));
  }

  [[nodiscard]] std::pair<const Rule*, const Pattern*> nearest() const {
    std::pair<const Rule*, const Pattern*> best{nullptr, nullptr};
    std::size_t least = 0;
    for (const Rule& rule : config_.policy.rules()) {
      for (const Pattern& pattern : rule.opens[direction_][question_.what]) {
        if (pattern.matches(question_.name)) continue;  // shown already
        const std::size_t here = edit_distance(pattern.text(), question_.name);
        const bool similar = 2 * here <= question_.name.size();
        if (!similar || (best.second != nullptr && here >= least)) continue;
        best = {&rule, &pattern};
        least = here;
      }
    }
    return best;
  }

  void tell_denied_services() {
    for (const auto& service : kParameterServices)
      for (const RuleTrace& said : ask_parameter_service(config_.policy, direction_, service).trace)
        if (denies(said))
          line(fmt::format("but not {}: denied by {}", service.token,
                           where(*said.rule, "deny", *said.denied_by)));
  }

  void tell_peer() {
    const Direction theirs =
        direction_ == Direction::kExport ? Direction::kImport : Direction::kExport;
    std::string by_default;
    if (config_.is_robot())
      by_default = fmt::format("; those of a {} without rules do{}",
                               config_.role == Role::kServer ? "client" : "server",
                               ask(Policy({default_rule()}), theirs).allowed ? "" : " not");
    line(fmt::format("the peer's rules must have it in {}{}", right_key(theirs, question_.what),
                     by_default));
  }

  // Images and clouds may lose something on a thin link, and a person has to know how to forbid it.
  void tell_lossy() {
    // A rule for one type answers for it.
    const std::vector<std::string>& types = deciding_->types;
    const std::string& type =
        question_.type.empty() && types.size() == 1 ? types.front() : question_.type;
    const auto is_lossy = [](const std::string& of) {
      return video::has_pictures(of) || is_cloud(of);
    };
    const bool concerned =
        question_.what == OpenedBy::kTopics &&
        (type.empty() ? types.empty() || std::any_of(types.begin(), types.end(), is_lossy)
                      : is_lossy(type));
    if (!concerned) return;
    const auto key = [&](std::string_view pair) {
      return config_.default_rules ? fmt::format("\"{}\" in a rule", pair)
                                   : fmt::format("\"rule.{}.{}\"", deciding_->name, pair);
    };
    if (const std::string_view exact = exact_by(deciding_->treatment); !exact.empty())
      return line(fmt::format("every message is exact by {}", key(exact)));
    if (!question_.video && video::has_pictures(type))
      return line("every message is exact: this build has no video");
    line(fmt::format("not exact where the link would carry too few exact ones ({}); {} forbids it",
                     is_cloud(type)    ? "rounded points"
                     : !type.empty()   ? "video"
                     : question_.video ? "a picture as video, a PointCloud2 rounded"
                                       : "a PointCloud2 rounded; this build has no video",
                     key("lossy: never")));
  }

  // The key that makes all messages exact; empty: none does. `keep` and `compression` of an
  // importer do not.
  [[nodiscard]] std::string_view exact_by(const Treatment& treatment) const {
    if (treatment.lossy == Lossy::kNever) return "lossy: never";
    if (treatment.resume == true) return "resume: true";
    if (direction_ == Direction::kImport) return {};
    if (treatment.keep == Keep::kAll) return "keep: all";
    return treatment.compression.automatic ? "" : "compression";
  }

  const Config& config_;
  const RightQuestion& question_;
  const Direction direction_;
  const std::string key_;
  const PolicyTrace trace_;  // points into config_.policy
  bool decided_ = false;
  const Rule* deciding_ = nullptr;
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
  RightAnswer all{{}, true};
  for (const Direction direction : {Direction::kExport, Direction::kImport}) {
    if (question.direction && *question.direction != direction) continue;
    const RightAnswer one = Explainer(config, question, direction).answer();
    all.text += one.text;
    all.allowed = all.allowed && one.allowed;
  }
  return all;
}

}  // namespace connect_bridge
