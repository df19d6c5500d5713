#include "sim/scenario.hpp"
#include "sim/types.hpp"

#include <algorithm>
#include <sstream>

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

struct TopicKind {
  const char* name;
  const char* type;
  bool latched;
  bool large;
};

const std::vector<TopicKind>& topic_kinds() {
  static const std::vector<TopicKind> kKinds = {
      {"/tf", "tf2_msgs/msg/TFMessage", false, false},
      {"/tf_static", "tf2_msgs/msg/TFMessage", true, false},
      {"/robot/odom", "nav_msgs/msg/Odometry", false, false},
      {"/robot/arm/state", "sensor_msgs/msg/JointState", false, false},
      {"/robot/_hidden/load", "std_msgs/msg/String", false, false},
      {"/camera/front/image", "sensor_msgs/msg/Image", false, true},
      {"/camera/front/raw", "sensor_msgs/msg/Image", false, true},
      {"/camera/secret/image", "sensor_msgs/msg/Image", false, true},
      {"/cmd_vel", "geometry_msgs/msg/Twist", false, false},
      {"/map", "nav_msgs/msg/OccupancyGrid", true, true},
      {"/scan", "sensor_msgs/msg/LaserScan", false, false},
      {"/robot_description", "std_msgs/msg/String", true, false},
      {"/chatter", "std_msgs/msg/String", false, false},
      {"/camera/left/points", "sensor_msgs/msg/PointCloud2", false, true},
      {"/robot/status", "std_msgs/msg/String", true, false}};
  return kKinds;
}

PathPlan random_path(Rng& rng) {
  PathPlan path;
  path.delay = rng.chance(700) ? rng.between(100us, 60ms) : rng.between(60ms, 200ms);
  if (rng.chance(600)) path.jitter = rng.between(Duration{100us}, path.delay + 2ms);
  const std::vector<std::int64_t> rates = {40'000, 100'000, 300'000, 1'000'000, 8'000'000};
  path.bytes_per_second = static_cast<std::uint64_t>(rng.pick(rates));
  const auto most =
      std::clamp<std::int64_t>(static_cast<std::int64_t>(path.bytes_per_second / 20), 4096, 65536);
  path.send_buffer = static_cast<std::size_t>(rng.between(1000, most));
  return path;
}

GraphPlan random_graph(Rng& rng, const Scenario& scenario) {
  GraphPlan graph;
  graph.clock.offset = rng.chance(700) ? rng.between(-5'000'000'000, 5'000'000'000)
                                       : rng.between(-3'600'000'000'000, 3'600'000'000'000);
  graph.clock.drift_ppb = rng.between(-100'000, 100'000);
  graph.tells_depth = rng.chance(600);
  if (rng.chance(300)) graph.name_delay = rng.between(1ms, 150ms);
  graph.discovery_max = rng.between(1ms, 60ms);
  graph.loss_permille = rng.chance(300) ? static_cast<unsigned>(rng.between(1, 100)) : 0;
  if (rng.chance(150) && !scenario.topics.empty()) {
    graph.unknown_types.push_back(rng.pick(scenario.topics).type);
  }
  return graph;
}

TopicPlan random_topic(Rng& rng, const TopicKind& kind, int graphs) {
  TopicPlan topic;
  topic.name = kind.name;
  topic.type = kind.type;
  topic.type_hash = hash_of_type(kind.type);
  topic.latched = kind.latched;
  topic.mixed = rng.chance(80);
  topic.graphs.push_back(static_cast<int>(rng.below(static_cast<std::uint64_t>(graphs))));
  if (rng.chance(250)) {
    topic.graphs.push_back(static_cast<int>(rng.below(static_cast<std::uint64_t>(graphs))));
  }
  const std::int64_t most = kind.large ? 60'000 : (rng.chance(150) ? 5000 : 600);
  topic.bytes_min = static_cast<std::size_t>(rng.between(32, most / 2));
  topic.bytes_max = static_cast<std::size_t>(rng.between(most / 2, most));
  if (kind.large && rng.chance(150)) {  // now and then something really large
    topic.bytes_max = static_cast<std::size_t>(rng.between(60'000, 400'000));
  }
  topic.compressible = rng.chance(600);
  topic.period = kind.large || kind.latched ? rng.between(60ms, 800ms) : rng.between(4ms, 200ms);
  return topic;
}

int graphs_of(Shape shape) {
  if (shape == Shape::kStar) return 3;
  return shape == Shape::kOneGraph ? 1 : 2;
}

HostPlan random_host(Rng& rng, Role role, int graph, int index, const PathPlan& path) {
  HostPlan host;
  host.graph = graph;
  host.options = random_options(rng, role, path);
  host.options.pictures = true;
  host.options.node = (rng.chance(500) ? "/connect" : "/bridge/connect") + std::to_string(index);
  host.options.policy = Policy{random_rules(rng)};
  host.start = rng.chance(500) ? Duration{rng.between(0, 50'000)} : rng.between(0ms, 1500ms);
  host.login_delay_max = rng.chance(900) ? 20ms : 6s;
  host.job_delay_max = rng.chance(800) ? 3ms : 150ms;
  host.graph_delay_max = rng.between(1ms, 60ms);
  return host;
}

void use_names(Rng& rng, HostPlan& host) {
  host.names.prefix = rng.chance(800) ? "/robot1" : "";
  if (rng.chance(300)) host.names.remap.push_back({"/chatter", "/talk/here"});
  host.options.names = NameMap{host.names.prefix, host.names.remap};
}

void give_login(Rng& rng, Scenario& scenario, PairPlan& pair, int number) {
  SideOptions& client = scenario.hosts[static_cast<std::size_t>(pair.client)].options;
  if (scenario.shape != Shape::kHostile && number == 0 && rng.chance(150)) {
    client.login_method = "none";
    return;
  }
  const std::string secret = "secret" + std::to_string(number);
  client.login_method = "token";
  client.credential.assign(secret.begin(), secret.end());
  if (rng.chance(30)) {
    pair.may_log_in = false;
    return;
  }
  Identity who;
  who.name = rng.chance(600) ? "ann" : "bob" + std::to_string(number);
  if (rng.chance(500)) who.groups = {"ops"};
  if (rng.chance(50))
    who.expires = rng.between(1500, kLoginMax / 1ms) * 1'000'000;  // from the login on
  scenario.accounts[secret] = who;
}

void add_pair(Rng& rng, Scenario& scenario, int server, int client) {
  PairPlan pair;
  pair.server = server;
  pair.client = client;
  pair.path = random_path(rng);
  scenario.pairs.push_back(pair);
}

// Which graph each host lives in, who dials whom: (graph, role) per host, servers first.
void place_hosts(Rng& rng, Scenario& scenario) {
  const auto host = [&](Role role, int graph) {
    scenario.hosts.push_back(
        random_host(rng, role, graph, static_cast<int>(scenario.hosts.size()), random_path(rng)));
  };
  host(Role::kServer, 0);
  switch (scenario.shape) {
    case Shape::kPair:
      host(Role::kClient, 1);
      add_pair(rng, scenario, 0, 1);
      break;
    case Shape::kHostile:
      host(Role::kClient, 1);
      add_pair(rng, scenario, 0, 1);
      host(Role::kClient, 1);  // dials a stranger
      scenario.hosts[2].options.policy = corner_for_all();
      scenario.hosts[2].meets_strangers = true;
      break;
    case Shape::kOneGraph:
      host(Role::kClient, 0);
      add_pair(rng, scenario, 0, 1);
      break;
    case Shape::kStar:
    case Shape::kSharedStar:
      host(Role::kClient, 1);
      host(Role::kClient, scenario.shape == Shape::kStar ? 2 : 1);
      add_pair(rng, scenario, 0, 1);
      add_pair(rng, scenario, 0, 2);
      break;
    case Shape::kTwoBridges: {
      const int other = rng.chance(500) ? 1 : 0;  // the second bridge may point the other way
      host(Role::kClient, 1);
      host(Role::kServer, 1 - other);
      host(Role::kClient, other);
      add_pair(rng, scenario, 0, 1);
      add_pair(rng, scenario, 2, 3);
      break;
    }
  }
}

Shape random_shape(Rng& rng) {
  const std::vector<Shape> shapes = {
      Shape::kPair,       Shape::kPair,       Shape::kPair,     Shape::kPair,    Shape::kPair,
      Shape::kPair,       Shape::kStar,       Shape::kStar,     Shape::kHostile, Shape::kSharedStar,
      Shape::kTwoBridges, Shape::kTwoBridges, Shape::kOneGraph, Shape::kHostile};
  return rng.pick(shapes);
}

}  // namespace

Scenario make_scenario(std::uint64_t seed) {
  Rng rng{seed};
  Scenario scenario;
  scenario.seed = seed;
  scenario.shape = random_shape(rng);
  const int graphs = graphs_of(scenario.shape);
  const auto topics = rng.between(1, 9);
  for (int i = 0; i < topics; ++i) {
    TopicPlan topic = random_topic(rng, rng.pick(topic_kinds()), graphs);
    const bool known = std::any_of(scenario.topics.begin(), scenario.topics.end(),
                                   [&](const auto& t) { return t.name == topic.name; });
    if (!known) scenario.topics.push_back(std::move(topic));
  }
  for (int i = 0; i < graphs; ++i) scenario.graphs.push_back(random_graph(rng, scenario));
  place_hosts(rng, scenario);
  for (std::size_t i = 0; i < scenario.pairs.size(); ++i) {
    PairPlan& pair = scenario.pairs[i];
    give_login(rng, scenario, pair, static_cast<int>(i));
    // Fragments must suit the line that is used.
    for (const int h : {pair.client, pair.server}) {
      auto& options = scenario.hosts[static_cast<std::size_t>(h)].options;
      options.outbox.fragment_bytes = std::min<std::uint32_t>(
          options.outbox.fragment_bytes, static_cast<std::uint32_t>(std::max<std::uint64_t>(
                                             1024, pair.path.bytes_per_second / 16)));
    }
  }
  if (scenario.shape == Shape::kPair && rng.chance(200)) use_names(rng, scenario.hosts[1]);
  if (rng.chance(200)) {
    for (int i = 0; i < 2; ++i) scenario.later_policies.emplace_back(random_rules(rng));
  }
  if (scenario.shape == Shape::kHostile) {
    HostPlan& server = scenario.hosts[0];
    server.meets_strangers = true;
    server.options.policy = with_strangers(server.options.policy);
    scenario.later_policies.clear();
  }
  scenario.chaos = rng.between(2s, 12s);
  scenario.churn = rng.between(100ms, 2s);
  scenario.weather = rng.chance(650) ? rng.between(200ms, 3s) : 0s;
  if (rng.chance(60)) {
    scenario.clock_step = rng.chance(500) ? rng.between(-20s, 20s) : rng.between(-3600s, 3600s);
  }
  scenario.crashes = scenario.weather > 0s && rng.chance(250);
  scenario.ending = static_cast<Ending>(rng.below(3));
  add_services(scenario);
  add_resumption(scenario);
  add_caps(scenario);
  add_relays(scenario);
  add_identities(scenario);
  // Links tell little here. The end of most takes several steps nevertheless, and so do offers.
  if (seed % 4 != 0)
    for (HostPlan& host : scenario.hosts) {
      host.options.ends_at_once = 1 + seed % 4;
      host.options.offers_at_once = host.options.offer_ends_at_once = 1 + seed % 3;
      host.options.listeners_at_once = 1 + seed % 2;
    }
  return scenario;
}

Duration Scenario::time_to_send(std::uint64_t bytes, std::uint64_t known) const {
  std::uint64_t slowest = std::min<std::uint64_t>(500'000, known);  // bytes per second
  for (const PairPlan& pair : pairs) slowest = std::min(slowest, pair.path.rate());
  return Duration(1s) * bytes / slowest;
}

std::string Scenario::text() const {
  static constexpr const char* kNames[kShapes] = {"pair",        "star",      "shared star",
                                                  "two bridges", "one graph", "hostile"};
  std::ostringstream out;
  out << kNames[static_cast<std::size_t>(shape)] << ", " << topics.size() << " topics, "
      << services.size() << " services, " << seconds(chaos) << " s of chaos, "
      << (weather > 0s ? "a disturbance every " + std::to_string(seconds(weather)) + " s"
                       : std::string("calm"))
      << (crashes ? ", crashes" : "") << (clock_step != 0s ? ", the clock is set" : "")
      << (later_policies.empty() ? "" : ", rules change") << (steady ? ", steady" : "")
      << (day ? ", a day" : "") << (long_goals ? ", goals of an hour" : "")
      << (by_identity ? ", names by identity" : "");
  for (const auto& pair : pairs) {
    out << "; side " << pair.client << " dials side " << pair.server << " ("
        << seconds(pair.path.one_way()) * 1000 << " ms, " << pair.path.rate() / 1000 << " kB/s"
        << (pair.path.has_relay() ? ", by a relay" : "")
        << (pair.may_log_in ? "" : ", may not log in") << ")";
  }
  return out.str();
}

}  // namespace connect_bridge::sim
