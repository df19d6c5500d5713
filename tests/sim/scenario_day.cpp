// The scenario of a day: one server and one client, with thin traffic of every kind.
#include "sim/scenario.hpp"
#include "sim/types.hpp"

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

TopicPlan topic(const char* name, const char* type, int graph, std::size_t bytes_max,
                Duration period) {
  TopicPlan plan;
  plan.name = name;
  plan.type = type;
  plan.type_hash = hash_of_type(type);
  plan.graphs = {graph};
  plan.bytes_min = 32;
  plan.bytes_max = bytes_max;
  plan.period = period;
  return plan;
}

void add_topics(Rng& rng, Scenario& scenario) {
  const auto add = [&](TopicPlan plan) {
    plan.compressible = rng.chance(600);
    scenario.topics.push_back(std::move(plan));
  };
  const auto lasting = [&](TopicPlan plan) {
    plan.lasting = true;
    add(std::move(plan));
  };
  const auto latched = [&](TopicPlan plan) {
    plan.latched = true;
    add(std::move(plan));
  };
  lasting(topic("/robot/odom", "nav_msgs/msg/Odometry", 0, 400, 2s));
  lasting(topic("/robot/arm/state", "sensor_msgs/msg/JointState", 0, 600, 3s));
  lasting(topic("/rosout", "rcl_interfaces/msg/Log", 0, 6000, 6s));
  lasting(topic("/chatter", "std_msgs/msg/String", 1, 300, 3s));
  lasting(topic("/plan", "nav_msgs/msg/Path", 1, 12'000, 15s));
  add(topic("/tf", "tf2_msgs/msg/TFMessage", 0, 600, 6s));
  add(topic("/cmd_vel", "geometry_msgs/msg/Twist", 1, 100, 4s));
  add(topic("/scan", "sensor_msgs/msg/LaserScan", 0, 3000, 8s));
  add(topic("/camera/front/image", "sensor_msgs/msg/Image", 0, 60'000, 40s));
  latched(topic("/map", "nav_msgs/msg/OccupancyGrid", 0, 8000, 90s));
  latched(topic("/robot/status", "std_msgs/msg/String", 0, 300, 20s));
  latched(topic("/goals", "std_msgs/msg/String", 1, 300, 30s));
}

void add_service(Rng& rng, Scenario& scenario, const char* name, const char* type,
                 std::int64_t bytes_max) {
  ServicePlan plan;
  plan.name = name;
  const auto hidden = plan.name.find("/_action/");
  if (hidden != std::string::npos) plan.action = plan.name.substr(0, hidden);
  plan.type = type;
  plan.type_hash = hash_of_type(type);
  plan.graphs = {static_cast<int>(rng.below(2))};
  plan.bytes_max = bytes_max;
  plan.compressible = rng.chance(600);
  plan.one_by_one = rng.chance(400);
  plan.work_max = rng.chance(700) ? rng.between(1ms, 50ms) : rng.between(50ms, 3s);
  // Nobody gives up a goal's result.
  if (plan.action.empty()) plan.never_permille = static_cast<unsigned>(rng.between(0, 30));
  plan.away_permille = static_cast<unsigned>(rng.between(0, 30));
  plan.away_max = rng.between(5ms, 2s);
  plan.period = rng.between(15s, 40s);
  plan.burst_max = rng.between(2, 12);
  scenario.services.push_back(std::move(plan));
}

Policy rules_of_day(Rng& rng) {
  Rule rest;
  rest.name = "rest";
  const std::vector<Pattern> all = {pattern("/**")};
  rest.opens[Direction::kExport][OpenedBy::kTopics] =
      rest.opens[Direction::kImport][OpenedBy::kTopics] = all;
  rest.opens[Direction::kExport][OpenedBy::kServices] =
      rest.opens[Direction::kImport][OpenedBy::kServices] = all;
  rest.opens[Direction::kExport][OpenedBy::kActions] =
      rest.opens[Direction::kImport][OpenedBy::kActions] = all;
  rest.opens[Direction::kExport][OpenedBy::kParameters] =
      rest.opens[Direction::kImport][OpenedBy::kParameters] = all;
  rest.treatment.call_timeout = 20s;
  rest.treatment.compression.automatic = rng.chance(700);
  return Policy{{std::move(rest)}};
}

// Small enough for what is forgotten to be given back soon to show.
void limit(Rng& rng, SideOptions& options) {
  const SideOptions usual;
  options.outbox.fragment_bytes = static_cast<std::uint32_t>(rng.between(1500, 2500));
  options.outbox.packet_bytes = static_cast<std::uint32_t>(rng.between(1000, 2000));
  options.outbox.unacknowledged_bytes_max = 400'000;
  options.outbox.data_bytes_max = 1'500'000;
  options.reassembly.message_bytes_max = usual.reassembly.message_bytes_max;
  options.history_bytes_max = 1 << 20;
  options.resume_for = 90s;  // the longest cut, and what it takes to be linked again
  options.resume_bytes_max = 600'000;
  options.calls_waiting_max = 60;
  options.call_bytes_max = 300'000;
  options.account = usual.account;
  options.account.memory_bytes_max = 32 << 20;
  // What TCP repairs, on a long path, neither looks like silence nor ends a login.
  options.dead_after = rng.between(3s, 5s);
  options.login_timeout = usual.login_timeout;
  options.default_depth = 100;
}

}  // namespace

Scenario make_day(std::uint64_t seed) {
  Rng rng{seed ^ 0xda1ULL};
  Scenario scenario;
  scenario.seed = seed;
  scenario.shape = Shape::kPair;
  scenario.day = true;
  PairPlan pair;
  pair.server = 0;
  pair.client = 1;
  pair.path.delay = 20ms;
  scenario.pairs.push_back(pair);
  add_topics(rng, scenario);
  add_service(rng, scenario, "/robot/arm/enable", "std_srvs/srv/SetBool", 100);
  scenario.services.back().lasting = true;
  add_service(rng, scenario, "/map/get", "nav_msgs/srv/GetMap", 10'000);
  add_service(rng, scenario, "/spawn", "turtlesim/srv/Spawn", 200);
  add_service(rng, scenario, "/robot/fib/_action/send_goal", "test/action/Fib_SendGoal", 200);
  const Policy rules = rules_of_day(rng);
  for (int i = 0; i < 2; ++i) {
    GraphPlan graph;
    graph.clock.offset = rng.between(-5'000'000'000, 5'000'000'000);
    graph.clock.drift_ppb = rng.between(-50'000, 50'000);
    graph.tells_depth = rng.chance(600);
    graph.tells_servers = rng.chance(600);
    graph.discovery_max = rng.between(1ms, 60ms);
    scenario.graphs.push_back(graph);
    HostPlan host;
    host.graph = i;
    host.options = random_options(rng, i == 0 ? Role::kServer : Role::kClient, pair.path);
    limit(rng, host.options);
    host.options.node = "/connect" + std::to_string(i);
    host.options.policy = rules;
    host.options.proxy_nodes = rng.chance(300);
    host.login_delay_max = 20ms;
    host.job_delay_max = 3ms;
    host.graph_delay_max = rng.between(1ms, 60ms);
    scenario.hosts.push_back(std::move(host));
  }
  scenario.chaos = 24h;
  scenario.churn = 60s;
  scenario.long_goals = rng.chance(500);
  scenario.ending = static_cast<Ending>(rng.below(3));
  return scenario;
}

}  // namespace connect_bridge::sim
