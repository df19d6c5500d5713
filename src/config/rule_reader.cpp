#include "config/rule_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "config/syntax.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {
namespace {

constexpr const char* kRights[] = {
    "export_topics",  "import_topics",     "export_services",   "import_services", "export_actions",
    "import_actions", "export_parameters", "import_parameters", "parameters",      "deny"};

std::vector<Pattern> patterns(const std::vector<std::string>& texts) {
  std::vector<Pattern> parsed;
  for (const std::string& text : texts) {
    if (auto pattern = Pattern::parse(text)) parsed.push_back(std::move(pattern).value());
  }
  return parsed;
}

bool matches(const std::vector<Pattern>& patterns, std::string_view name) {
  return std::any_of(patterns.begin(), patterns.end(),
                     [&](const Pattern& pattern) { return pattern.matches(name); });
}

// For a client without rules. Everything that the server allows exists here. The server may receive
// the topics of this side that its rules import. It may never call services here: a client does not
// trust a server that far.
Rule default_rule() {
  Rule rule;
  rule.name = "default";
  rule.export_topics = patterns({"/**"});
  rule.import_topics = patterns({"/**"});
  rule.import_services = patterns({"/**"});
  rule.import_actions = patterns({"/**"});
  rule.import_parameters = patterns({"/**"});
  // Every node publishes it; merged with the local one, the sender of a message could not be
  // identified.
  rule.deny = patterns({"/rosout"});
  rule.treatment.compression.automatic = true;  // as every rule has it
  return rule;
}

// With `clock: publish` the core makes /clock from the link's clock offset. The peer's own /clock
// in addition would be a second, late time; and the /clock that we publish must not be exported
// back.
Rule clock_rule(const std::string& name) {
  Rule rule;
  rule.name = name + ".clock";  // a dot: no rule of the operator has this name
  rule.deny = patterns({"/clock"});
  return rule;
}

// Reads the keys of one rule.
class RuleReader {
 public:
  RuleReader(const CheckedValues& values, std::string name, Role role)
      : values_(values), name_(std::move(name)), role_(role) {}

  [[nodiscard]] Rule rule() const {
    Rule rule;
    rule.name = name_;
    rule.export_topics = patterns(values_.list(key("export_topics")));
    rule.import_topics = patterns(values_.list(key("import_topics")));
    rule.export_services = patterns(values_.list(key("export_services")));
    rule.import_services = patterns(values_.list(key("import_services")));
    rule.export_actions = patterns(values_.list(key("export_actions")));
    rule.import_actions = patterns(values_.list(key("import_actions")));
    rule.export_parameters = patterns(values_.list(key("export_parameters")));
    rule.import_parameters = patterns(values_.list(key("import_parameters")));
    auto& own = role_ == Role::kServer ? rule.export_parameters : rule.import_parameters;
    for (auto& pattern : patterns(values_.list(key("parameters")))) own.push_back(pattern);
    rule.deny = patterns(values_.list(key("deny")));
    rule.types = values_.list(key("types"));
    rule.identities = values_.list(key("identities"));
    rule.groups = values_.list(key("groups"));
    rule.treatment = treatment();
    return rule;
  }

  [[nodiscard]] std::string key(std::string_view suffix) const {
    return fmt::format("rule.{}.{}", name_, suffix);
  }

  // A wrong list counts too, since its own problem is reported already.
  [[nodiscard]] bool allows_or_denies() const {
    return std::any_of(std::begin(kRights), std::end(kRights), [&](const char* suffix) {
      const std::string right = key(suffix);
      return values_.given(right) && !(values_.valid(right) && values_.list(right).empty());
    });
  }

 private:
  [[nodiscard]] Treatment treatment() const {
    Treatment treatment;
    treatment.priority = value_of(kPriorityWords, values_.text(key("priority")));
    treatment.compression =
        syntax::parse_compression(values_.text(key("compression"))).value_or(Compression{});
    treatment.max_rate = values_.number(key("max_rate"));
    treatment.bytes_per_second_max =
        static_cast<std::uint64_t>(values_.whole(key("max_bytes_per_second")));
    treatment.max_age = duration("max_age").value_or(kForever);
    treatment.queue_bytes_max = static_cast<std::uint64_t>(values_.whole(key("queue_bytes_max")));
    treatment.qos = qos();
    if (values_.valid(key("resume"))) treatment.resume = values_.flag(key("resume"));
    treatment.allow_type_mismatch = values_.flag(key("allow_type_mismatch"));
    treatment.calls_max = static_cast<std::uint32_t>(values_.whole(key("calls_max")));
    treatment.server_queue = static_cast<std::uint32_t>(values_.whole(key("server_queue")));
    treatment.call_timeout = duration("call_timeout").value_or(kForever);
    return treatment;
  }

  [[nodiscard]] QosOverride qos() const {
    QosOverride qos;
    qos.reliability = value_of(kReliabilityWords, values_.text(key("qos.reliability")));
    qos.durability = value_of(kDurabilityWords, values_.text(key("qos.durability")));
    if (values_.valid(key("qos.depth"))) {
      qos.depth = static_cast<std::uint32_t>(values_.whole(key("qos.depth")));
    }
    qos.deadline = duration("qos.deadline");
    qos.lifespan = duration("qos.lifespan");
    return qos;
  }

  [[nodiscard]] std::optional<Duration> duration(std::string_view suffix) const {
    if (!values_.valid(key(suffix))) return std::nullopt;
    return from_seconds(values_.number(key(suffix)));
  }

  const CheckedValues& values_;
  std::string name_;
  Role role_;
};

void check_clock(const CheckedValues& values, const RuleReader& reader, const Rule& rule,
                 RuleSet& set, std::vector<Problem>& problems) {
  const std::string clock = reader.key("clock");
  const std::string rate = reader.key("clock_rate");
  if (values.text(clock) != "publish") {
    if (values.given(rate) && !(values.given(clock) && !values.valid(clock))) {
      problems.push_back({rate, "", "clock: publish too, else the rate has no meaning"});
    }
    return;
  }
  if (values.valid(reader.key("import_topics")) && !matches(rule.import_topics, "/clock")) {
    problems.push_back({clock, "\"publish\"", "/clock among import_topics of this rule"});
  } else if (!values.given(reader.key("import_topics"))) {
    problems.push_back({clock, "\"publish\"", "import_topics: [/clock] too"});
  }
  if (set.clock_publish_period != Duration::zero()) {
    problems.push_back({clock, "\"publish\"", "only one rule with clock: publish"});
  }
  set.clock_publish_period = from_seconds(1.0 / values.number(rate));
}

void check_listed(const CheckedValues& values, const std::vector<std::string>& names, Moment moment,
                  std::vector<Problem>& problems, std::vector<std::string>& warnings) {
  for (const std::string& name : names) {
    if (values.rules().contains(name)) continue;
    problems.push_back(
        {"rules", to_text(name),
         fmt::format("a rule that is defined, e.g. by rule.{}.import_topics", name)});
  }
  for (const std::string& name : values.rules()) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    if (moment == Moment::kStart) {
      problems.push_back({"rule." + name, "", "its name in `rules`, else it has no effect"});
    } else {
      warnings.push_back(fmt::format("rule.{0}: has no effect, `rules` does not name {0}", name));
    }
  }
}

}  // namespace

Duration from_seconds(double seconds) {
  return Duration{static_cast<Duration::rep>(std::llround(seconds * 1e9))};
}

RuleSet read_rules(const CheckedValues& values, Role role, Moment moment,
                   std::vector<Problem>& problems, std::vector<std::string>& warnings) {
  RuleSet set;
  const bool listed = !values.given("rules") || values.valid("rules");
  const std::vector<std::string> names = values.list("rules");
  if (listed) check_listed(values, names, moment, problems, warnings);
  std::string clock_from;
  for (const std::string& name : names) {
    if (!values.rules().contains(name)) continue;
    const RuleReader reader(values, name, role);
    set.rules.push_back(reader.rule());
    if (!reader.allows_or_denies()) {
      problems.push_back({"rule." + name, "",
                          "at least one of export_topics, import_topics, export_services, ...: "
                          "this rule allows nothing"});
    }
    check_clock(values, reader, set.rules.back(), set, problems);
    if (values.text(reader.key("clock")) == "publish") clock_from = name;
  }
  if (!clock_from.empty()) set.rules.push_back(clock_rule(clock_from));
  if (!names.empty() || !values.rules().empty()) return set;
  if (role == Role::kClient) {
    set.rules.push_back(default_rule());
    set.defaults = true;
  } else {
    warnings.push_back(
        "rules: there are none, so no peer may exchange anything with this server. "
        "docs/config.md shows how to write one");
  }
  return set;
}

}  // namespace connect_bridge
