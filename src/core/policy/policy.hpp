// Rules: who may exchange which interface in which direction, and how it is treated. Default deny.
// docs/config.md section "Rules": the first match decides the treatment, any deny wins.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/policy/enum_array.hpp"
#include "core/policy/interface.hpp"
#include "core/policy/pattern.hpp"
#include "core/policy/treatment.hpp"
#include "core/wire/control.hpp"

namespace connect_bridge {

enum class Direction : std::uint8_t { kExport, kImport };

// The identity of a peer, as the login method found it.
struct Identity {
  std::string name;  // empty: nobody (no login required)
  std::vector<std::string> groups;
  Stamp expires = 0;  // system clock, ns; 0: never
  // The credential that proved the identity, as named by the login method; not a secret. Empty: the
  // credential cannot be withdrawn.
  std::string credential = {};
};

struct Rule {
  std::string name;
  // The patterns that open names, for parameters names of nodes; kNothing has none.
  EnumArray<Direction, EnumArray<OpenedBy, std::vector<Pattern>, 5>, 2> opens;
  std::vector<Pattern> deny;            // wins over the allow patterns of every rule
  std::vector<std::string> types;       // empty: any
  std::vector<std::string> identities;  // empty (and groups empty): anyone who is logged in
  std::vector<std::string> groups;
  Treatment treatment;
};

// Whether what is for these identities and groups is for this peer; if there are neither, it is for
// all.
[[nodiscard]] bool is_for(const std::vector<std::string>& identities,
                          const std::vector<std::string>& groups, const Identity& who);

// The rule that allows an interface, and the treatment of its messages.
struct Decision {
  std::string rule;  // name of the rule that matched
  Treatment treatment;
};

// The judgement of one rule about one interface; points into the policy.
struct RuleTrace {
  const Rule* rule = nullptr;
  bool applies = false;                // to who asks
  const Pattern* denied_by = nullptr;  // the first that covers it; null: none does
  const Pattern* opened_by = nullptr;  // the first that matches it, for its types or not
  bool type_fits = false;
};
using PolicyTrace = std::vector<RuleTrace>;

// An immutable set of rules. A change is a new Policy.
class Policy {
 public:
  Policy() = default;  // allows nothing
  explicit Policy(std::vector<Rule> rules) : rules_(std::move(rules)) {}

  // The decision of the first rule that opens this interface in `direction` for `who`, unless a
  // deny pattern of any rule that applies to `who` covers it. For every concrete channel: topics,
  // services, parts of actions (opened by the patterns for actions alone, with the action's name
  // and type), parameter services and origins of /parameter_events (opened by the patterns for
  // parameters alone, with the node's name, whatever `types` says). Hidden names (a token
  // starting with '_') are allowed only by a pattern that spells that token out. A deny covers an
  // action by its name or that of any part; a node's parameters by the node's name or that of a
  // single service.
  // `trace`: if not null, gets what each rule says, in their order; nothing if no rule can open
  // what has this name and type.
  [[nodiscard]] std::optional<Decision> decide(Direction direction, const Interface& what,
                                               const Identity& who,
                                               PolicyTrace* trace = nullptr) const;
  // The same for a topic, a service, or a whole action (kAction, with its own name and type).
  [[nodiscard]] std::optional<Decision> decide(Direction direction, InterfaceKind kind,
                                               std::string_view name, std::string_view type,
                                               const Identity& who,
                                               PolicyTrace* trace = nullptr) const;
  // Whether /parameter_events with this type is carried at all (with another than its own it never
  // is), and how it is treated: by the first rule that opens the parameters of some node. Which of
  // its origins are carried is decided by decide() for each.
  [[nodiscard]] std::optional<Decision> decide_parameter_events(Direction direction,
                                                                std::string_view type,
                                                                const Identity& who) const;

  // The names that a peer with this identity may offer us (the wire's `accepts`).
  [[nodiscard]] Accepts accepts(const Identity& who) const;

  [[nodiscard]] const std::vector<Rule>& rules() const { return rules_; }

 private:
  std::vector<Rule> rules_;
};

}  // namespace connect_bridge
