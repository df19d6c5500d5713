// The services of a scenario: which there are, who may use them, and how they behave.
#include <algorithm>

#include "sim/scenario.hpp"
#include "sim/types.hpp"

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

struct ServiceKind {
  const char* name;
  const char* type;
  bool large;
};

const std::vector<ServiceKind>& service_kinds() {
  static const std::vector<ServiceKind> kKinds = {
      {"/robot/arm/enable", "std_srvs/srv/SetBool", false},
      {"/robot/arm/reset", "std_srvs/srv/Trigger", false},
      {"/map/get", "nav_msgs/srv/GetMap", true},
      {"/spawn", "turtlesim/srv/Spawn", false},
      {"/camera/front/capture", "camera/srv/Capture", true},
      {"/camera/secret/unlock", "std_srvs/srv/SetBool", false},
      {"/robot/_hidden/dump", "std_srvs/srv/Trigger", false},
      {"/camera/driver/get_parameters", "rcl_interfaces/srv/GetParameters", false},
      {"/robot/base/set_parameters", "rcl_interfaces/srv/SetParameters", false},
      // A name that belongs to parameters, with another type: nothing opens it.
      {"/robot/base/list_parameters", "std_srvs/srv/Trigger", false},
      {"/robot/fib/_action/send_goal", "test/action/Fib_SendGoal", false},
      {"/navigate/_action/send_goal", "test/action/Fib_SendGoal", false},
      {"/chatter", "std_srvs/srv/Trigger", false},  // as a topic is called, and remapped with it
  };
  return kKinds;
}

const std::vector<std::string>& service_patterns() {
  static const std::vector<std::string> kTexts = {"/**",
                                                  "/**",
                                                  "/robot/**",
                                                  "/robot/*/*",
                                                  "/*",
                                                  "/map/*",
                                                  "/camera/**",
                                                  "/robot/_hidden/*",
                                                  "/**/get_parameters",
                                                  "/spawn",
                                                  "/**/set_parameters",
                                                  "/camera/driver",
                                                  "/robot/base",
                                                  "/**/_action/**",
                                                  "/*/*/enable"};
  return kTexts;
}

void draw_services(Rng& rng, std::vector<Pattern>& into) {
  const auto count = rng.between(0, 3);
  for (int i = 0; i < count; ++i) into.push_back(pattern(rng.pick(service_patterns())));
}

void draw_limits(Rng& rng, Treatment& treatment) {
  if (rng.chance(300)) treatment.calls_max = static_cast<std::uint32_t>(rng.between(1, 8));
  if (rng.chance(120)) treatment.call_timeout = rng.between(300ms, 3s);
}

// `strangers`: the rules at the end are not for everybody.
Policy with_services(Rng& rng, const Policy& policy, bool strangers) {
  std::vector<Rule> rules = policy.rules();
  for (auto& rule : rules) {
    draw_limits(rng, rule.treatment);
    if (rule.name == "corner") continue;  // the strangers', and all theirs
    if (rng.chance(300)) draw_services(rng, rule.opens[Direction::kExport][OpenedBy::kServices]);
    if (rng.chance(300)) draw_services(rng, rule.opens[Direction::kImport][OpenedBy::kServices]);
    if (rng.chance(200)) draw_services(rng, rule.opens[Direction::kExport][OpenedBy::kParameters]);
    if (rng.chance(200)) draw_services(rng, rule.opens[Direction::kImport][OpenedBy::kParameters]);
    if (rng.chance(300)) draw_services(rng, rule.opens[Direction::kExport][OpenedBy::kActions]);
    if (rng.chance(300)) draw_services(rng, rule.opens[Direction::kImport][OpenedBy::kActions]);
  }
  if (rng.chance(850)) {
    Rule calls;
    calls.name = "calls";
    calls.opens[Direction::kExport][OpenedBy::kServices] = {pattern("/**")};
    calls.opens[Direction::kImport][OpenedBy::kServices] = {pattern("/**")};
    if (rng.chance(700)) calls.opens[Direction::kExport][OpenedBy::kParameters] = {pattern("/**")};
    if (rng.chance(700)) calls.opens[Direction::kImport][OpenedBy::kParameters] = {pattern("/**")};
    if (rng.chance(800)) calls.opens[Direction::kExport][OpenedBy::kActions] = {pattern("/**")};
    if (rng.chance(800)) calls.opens[Direction::kImport][OpenedBy::kActions] = {pattern("/**")};
    if (rng.chance(200)) calls.deny = {pattern(rng.pick(service_patterns()))};
    if (rng.chance(300)) {
      calls.treatment.compression.codec = rng.chance(500) ? Codec::kLz4 : Codec::kZstd;
    } else if (rng.chance(500)) {
      calls.treatment.compression.automatic = true;
    }
    if (strangers) calls.identities = {"ann", "bob0"};
    draw_limits(rng, calls.treatment);
    rules.push_back(std::move(calls));
  }
  return Policy{std::move(rules)};
}

ServicePlan random_service(Rng& rng, const ServiceKind& kind, int graphs) {
  ServicePlan service;
  service.name = kind.name;
  const auto hidden = service.name.find("/_action/");
  if (hidden != std::string::npos) service.action = service.name.substr(0, hidden);
  service.type = kind.type;
  service.type_hash = hash_of_type(kind.type);
  const auto servers = rng.chance(750) ? 1 : rng.between(2, 3);
  for (int i = 0; i < servers; ++i) {
    service.graphs.push_back(static_cast<int>(rng.below(static_cast<std::uint64_t>(graphs))));
  }
  service.bytes_max = kind.large ? rng.between(1000, 40'000) : rng.between(40, 400);
  service.compressible = rng.chance(600);
  service.one_by_one = rng.chance(400);
  service.work_max = rng.chance(700) ? rng.between(100us, 20ms) : rng.between(20ms, 3s);
  service.never_permille = rng.chance(400) ? static_cast<unsigned>(rng.between(10, 300)) : 0;
  service.period = rng.between(20ms, 600ms);
  service.burst_max = rng.chance(850) ? rng.between(2, 12) : rng.between(20, 90);
  // With the longest work of one call it is silent for less than the 5 s of an exporter's patience.
  service.away_permille = rng.chance(400) ? static_cast<unsigned>(rng.between(5, 200)) : 0;
  service.away_max = rng.between(5ms, 3500ms);
  return service;
}

}  // namespace

void add_services(Scenario& scenario) {
  Rng rng{scenario.seed ^ 0x5e41ce5ULL};
  if (!rng.chance(500)) return;
  const int graphs = static_cast<int>(scenario.graphs.size());
  const auto count = rng.between(1, 5);
  for (int i = 0; i < count; ++i) {
    ServicePlan plan = random_service(rng, rng.pick(service_kinds()), graphs);
    const bool known = std::any_of(scenario.services.begin(), scenario.services.end(),
                                   [&](const auto& s) { return s.name == plan.name; });
    if (!known) scenario.services.push_back(std::move(plan));
  }
  for (auto& graph : scenario.graphs) {
    graph.tells_servers = rng.chance(600);
    if (rng.chance(80)) graph.unknown_types.push_back(rng.pick(scenario.services).type);
  }
  for (auto& host : scenario.hosts) {
    host.options.policy = with_services(rng, host.options.policy, host.meets_strangers);
    if (rng.chance(150)) {
      host.options.calls_waiting_max = static_cast<std::uint32_t>(rng.between(3, 40));
    }
    host.options.call_bytes_max = static_cast<std::uint64_t>(rng.between(100'000, 2'000'000));
    host.options.proxy_nodes = rng.chance(300);
  }
  for (auto& policy : scenario.later_policies) policy = with_services(rng, policy, false);
  const bool action = std::any_of(scenario.services.begin(), scenario.services.end(),
                                  [](const auto& s) { return !s.action.empty(); });
  scenario.long_goals = action && rng.chance(60);
}

}  // namespace connect_bridge::sim
