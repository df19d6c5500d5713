#include "ops/doctor/diagnosis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <iterator>
#include <sstream>
#include <utility>

#include "core/driving/command.hpp"
#include "core/wire/text.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kSeenBytes = 300;
constexpr std::uint64_t kSharedMemoryBytes = 64ULL << 20;

std::string value_of(const ProcessFacts& process, const char* name, const char* otherwise) {
  const auto found = process.variables.find(name);
  return found == process.variables.end() || found->second.empty() ? otherwise : found->second;
}

}  // namespace

std::string_view finding_for(Cause cause) {
  switch (cause) {
    case Cause::kCertificateEarly: return "clock_or_certificate_early";
    case Cause::kOtherKey: return "certificate_pin";
    case Cause::kAddressGone: return "connection_lost";
    case Cause::kGoingAway: return "peer_stops";
    case Cause::kSilent: return "link_silent";
    case Cause::kSameSide: return "dialed_itself";
    case Cause::kExpired: return "login_expired";
    case Cause::kRevoked: return "login_withdrawn";
    case Cause::kValueWrong: return "file_wrong";
    case Cause::kNone:
    case Cause::kOther:
    case Cause::kClosed:
    case Cause::kNormal:
    case Cause::kMalformed:
    case Cause::kReplaced:
    case Cause::kTooLarge:
    case Cause::kSlowPeer:
    case Cause::kIllegal:
    case Cause::kUnknownChannel:
    case Cause::kInternal: return "link_fails";
    default: return word_of(cause);  // the finding has the word of the cause
  }
}

Found diagnose(const Failure& failure) {
  return {finding_for(failure.cause), {}, to_text(failure.text, kSeenBytes)};
}

Found diagnose_port(const Failure& failure, std::optional<std::uint32_t> listener,
                    std::uint32_t user) {
  Found found = diagnose(failure);
  const bool may_be_it =
      failure.cause == Cause::kPortNotPermitted || failure.cause == Cause::kPortTaken;
  if (may_be_it && listener && *listener != user) found.id = "port_hidden";
  return found;
}

namespace {

// Wildcards are compared as texts: the same one, or all names.
bool takes_all_of(const Pattern& by, const Pattern& names) {
  const bool is_hidden = names.text().find("/_") != std::string::npos;
  if (by == names || (by.text() == "/**" && !is_hidden)) return true;
  return !has_wildcard(names.text()) && by.matches(names.text());
}

// Whether all that `rule` opens is opened before it, for everybody.
bool is_hidden_by(const Rule& before, const Rule& rule) {
  if (!rule.deny.empty()) return false;  // a deny counts wherever it stands
  if (!before.identities.empty() || !before.groups.empty() || !before.types.empty()) return false;
  bool opens = false;
  for (const Direction direction : {Direction::kExport, Direction::kImport})
    for (std::size_t by = 0; by < rule.opens[direction].values.size(); ++by) {
      const auto& first = before.opens[direction].values[by];
      for (const Pattern& names : rule.opens[direction].values[by]) {
        opens = true;
        if (std::none_of(first.begin(), first.end(),
                         [&](const Pattern& all) { return takes_all_of(all, names); }))
          return false;
      }
    }
  return opens && before.treatment != rule.treatment;
}

void look_at_order(const std::vector<Rule>& rules, std::vector<Found>& found) {
  for (auto rule = rules.begin(); rule != rules.end(); ++rule)
    for (auto before = rules.begin(); before != rule; ++before)
      if (is_hidden_by(*before, *rule)) {
        found.push_back({"rule_hidden", rule->name, "by the rule " + before->name});
        break;
      }
}

// Types that a rule names, of which none can be halted.
void look_at_halts(const Rule& rule, std::vector<Found>& found) {
  const auto halts = [](const std::string& type) { return driving::command_type(type); };
  if (rule.treatment.halt_after != kForever && !rule.types.empty() &&
      std::none_of(rule.types.begin(), rule.types.end(), halts))
    found.push_back({"halts_nothing", rule.name, rule.types.front()});
}

}  // namespace

std::vector<Found> diagnose_config(const Config& config) {
  std::vector<Found> found;
  look_at_order(config.policy.rules(), found);
  bool opens = false;
  for (const Rule& rule : config.policy.rules()) {
    for (const auto& in_direction : rule.opens.values)
      for (const auto& patterns : in_direction.values) opens = opens || !patterns.empty();
    look_at_halts(rule, found);
    if (rule.treatment.max_age == kForever) continue;
    for (const auto& in_direction : rule.opens.values)
      for (const Pattern& pattern : in_direction[OpenedBy::kTopics])
        for (const char* latched : {"/tf_static", "/map", "/robot_description"})
          if (pattern.text() == latched)
            found.push_back({"max_age_and_latched", rule.name, latched});
  }
  if (!opens) found.push_back({"rule_allows_nothing", {}, {}});
  return found;
}

namespace {

// Robots may share a graph of transforms and diagnostics, with frames and names of their own.
bool is_shared_by_robots(const std::string& topic) {
  return topic == "/tf" || topic == "/tf_static" || topic == "/diagnostics" || topic == "/rosout";
}

void compare_programs(const ProgramFacts& one, const ProgramFacts& other,
                      std::vector<Found>& found) {
  if (one.node.empty() || one.domain != other.domain) return;
  if (one.node == other.node) {
    found.push_back({"same_name", to_text(one.node, kSeenBytes),
                     fmt::format("processes {} and {}", one.process, other.process)});
    return;
  }
  for (const std::string& topic : one.brings)
    if (other.brings.contains(topic) && !is_shared_by_robots(topic))
      found.push_back({"names_collide", topic,
                       to_text(one.node, kSeenBytes) + " and " + to_text(other.node, kSeenBytes)});
}

}  // namespace

std::vector<Found> diagnose_programs(const std::vector<ProgramFacts>& programs) {
  std::vector<Found> found;
  for (auto one = programs.begin(); one != programs.end(); ++one)
    for (auto other = std::next(one); other != programs.end(); ++other)
      compare_programs(*one, *other, found);
  return gathered(found);
}

bool holds_configuration(std::string_view value) {
  return value.find_first_of("<{=") != std::string_view::npos;
}

void gather_domains(const std::vector<ProgramFacts>& programs, std::vector<Found>& found) {
  std::set<std::string> domains;
  for (const ProgramFacts& one : programs)
    if (!one.domain.empty()) domains.insert(one.domain);
  const auto is_of_domain = [](const Found& one) { return one.id == "domain_differs"; };
  const auto first = std::find_if(found.begin(), found.end(), is_of_domain);
  if (first == found.end()) return;
  if (domains.size() > 1) {
    std::erase_if(found, is_of_domain);
    return;
  }
  if (std::find_if(std::next(first), found.end(), is_of_domain) == found.end()) return;
  first->program.clear();
  found.erase(std::remove_if(std::next(first), found.end(), is_of_domain), found.end());
}

std::vector<Found> diagnose_processes(const ProcessFacts& side, const ProcessFacts& shell) {
  std::vector<Found> found;
  const auto shown = [](const std::string& value) {
    if (holds_configuration(value)) return std::string("set inline");
    return value.empty() ? std::string("not set") : to_text(value, kSeenBytes);
  };
  const auto compare = [&](std::string_view id, const char* name, const char* otherwise) {
    const std::string there = value_of(side, name, otherwise);
    const std::string here = value_of(shell, name, otherwise);
    if (there != here)
      found.push_back({id, name, fmt::format("{} there, {} here", shown(there), shown(here))});
  };
  compare("domain_differs", "ROS_DOMAIN_ID", "0");
  compare("rmw_differs", "RMW_IMPLEMENTATION", "rmw_fastrtps_cpp");
  constexpr char kRange[] = "ROS_AUTOMATIC_DISCOVERY_RANGE";
  if (value_of(side, kRange, "") == "OFF" || value_of(shell, kRange, "") == "OFF")
    found.push_back({"discovery_range", kRange, "OFF: nobody is found"});
  else
    compare("discovery_range", kRange, "SUBNET");
  compare("discovery_range", "ROS_LOCALHOST_ONLY", "0");
  for (const char* name : kMiddlewareVariables) compare("middleware_differs", name, "");
  if (side.user != shell.user)
    found.push_back({"user_differs", {}, fmt::format("{} there, {} here", side.user, shell.user)});
  return found;
}

std::vector<Found> diagnose_throttling(const std::string& cpu_stat) {
  constexpr double kPeriods = 100;  // of 0.1 s mostly
  std::istringstream in(cpu_stat);
  double periods = 0, throttled = 0, value = 0;
  for (std::string name; in >> name >> value;) {
    if (name == "nr_periods") periods = value;
    if (name == "nr_throttled") throttled = value;
  }
  if (periods < kPeriods || 2 * throttled < periods) return {};
  return {
      {"processor_limited", {}, fmt::format("in {:.0f} of {:.0f} periods", throttled, periods)}};
}

// Domains beyond 232 would need ports beyond 65,535.
std::vector<Found> diagnose_shell(const ProcessFacts& shell) {
  constexpr int kDomainMax = 232;
  const std::string domain = value_of(shell, "ROS_DOMAIN_ID", "0");
  int number = -1;
  const auto [end, error] = std::from_chars(domain.data(), domain.data() + domain.size(), number);
  const bool is_number = error == std::errc() && end == domain.data() + domain.size();
  if (is_number && number >= 0 && number <= kDomainMax) return {};
  return {{"domain_wrong", "ROS_DOMAIN_ID", to_text(domain, kSeenBytes)}};
}

std::vector<Found> diagnose_machine(const MachineFacts& machine) {
  std::vector<Found> found;
  if (machine.shared_memory_free_bytes < kSharedMemoryBytes)
    found.push_back({"shared_memory_small", "/dev/shm",
                     fmt::format("{:.0f} MB are free",
                                 static_cast<double>(machine.shared_memory_free_bytes) / 1e6)});
  if (machine.loses && !machine.congestion_controls.empty() &&
      machine.congestion_controls.find("bbr") == std::string::npos)
    found.push_back({"no_bbr", {}, "allowed are " + machine.congestion_controls});
  return found;
}

}  // namespace connect_bridge
