// Rules and limits of simulated sides.
#include <algorithm>

#include "sim/scenario.hpp"

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

const std::vector<std::string>& topic_patterns() {
  static const std::vector<std::string> kTexts = {"/**",
                                                  "/**",
                                                  "/**",
                                                  "/camera/**",
                                                  "/camera/*/image",
                                                  "/tf",
                                                  "/tf*",
                                                  "/robot/**",
                                                  "/**/odom",
                                                  "/*",
                                                  "/cmd_vel",
                                                  "/map",
                                                  "/*/*",
                                                  "/robot/_hidden/*",
                                                  "/robot/*/*",
                                                  "/robot/**/state",
                                                  "/scan",
                                                  "/_connect_bridge/**"};
  return kTexts;
}

const std::vector<std::string>& denied_patterns() {
  static const std::vector<std::string> kTexts = {"/camera/secret/**", "/map",   "/robot/**/odom",
                                                  "/camera/*/raw",     "/_*/**", "/scan",
                                                  "/robot/_hidden/**", "/cmd_*"};
  return kTexts;
}

Treatment random_treatment(Rng& rng) {
  Treatment t;
  if (rng.chance(300)) t.priority = static_cast<Priority>(rng.below(kPriorities));
  if (rng.chance(300)) {
    t.compression.codec = rng.chance(300) ? Codec::kLz4 : Codec::kZstd;
    t.compression.level = static_cast<int>(rng.between(1, 5));
  } else if (rng.chance(700)) {
    t.compression.automatic = true;
  }
  if (rng.chance(60)) t.max_rate = static_cast<double>(rng.between(1, 50));
  if (rng.chance(40)) {
    t.bytes_per_second_max = static_cast<std::uint64_t>(rng.between(1000, 100'000));
  }
  if (rng.chance(80)) t.max_age = rng.between(50ms, 1500ms);
  if (rng.chance(150)) t.queue_bytes_max = static_cast<std::uint64_t>(rng.between(100, 100'000));
  if (rng.chance(40)) t.qos.reliability = Reliability::kBestEffort;
  if (rng.chance(20)) t.qos.durability = Durability::kVolatile;
  if (rng.chance(40)) t.qos.depth = static_cast<std::uint32_t>(rng.between(1, 30));
  return t;
}

void draw_topics(Rng& rng, std::vector<Pattern>& into) {
  const auto count = rng.between(0, 3);
  for (int i = 0; i < count; ++i) into.push_back(pattern(rng.pick(topic_patterns())));
}

}  // namespace

Pattern pattern(const std::string& text) {
  auto parsed = Pattern::parse(text);
  if (!parsed) violated("the simulation uses a bad pattern: " + parsed.error().message);
  return std::move(parsed).value();
}

std::vector<Rule> random_rules(Rng& rng) {
  std::vector<Rule> rules;
  const auto count = rng.between(0, 3);
  for (int i = 0; i < count; ++i) {
    Rule rule;
    rule.name = "rule" + std::to_string(i);
    draw_topics(rng, rule.opens[Direction::kExport][OpenedBy::kTopics]);
    draw_topics(rng, rule.opens[Direction::kImport][OpenedBy::kTopics]);
    if (rng.chance(250)) rule.deny.push_back(pattern(rng.pick(denied_patterns())));
    if (rng.chance(150)) rule.types = {"std_msgs/msg/String", "nav_msgs/msg/Odometry"};
    if (rng.chance(150)) rule.identities = {"ann"};
    if (rng.chance(100)) rule.groups = {"ops"};
    rule.treatment = random_treatment(rng);
    rules.push_back(std::move(rule));
  }
  if (rng.chance(350)) {  // commands before everything
    Rule commands;
    commands.name = "commands";
    commands.opens[Direction::kExport][OpenedBy::kTopics] = {pattern("/cmd_vel"), pattern("/scan")};
    commands.opens[Direction::kImport][OpenedBy::kTopics] =
        commands.opens[Direction::kExport][OpenedBy::kTopics];
    commands.treatment.priority = Priority::kUrgent;
    rules.insert(rules.begin(), std::move(commands));
  }
  if (rng.chance(850)) {  // the rest of the world, as it comes
    Rule rest;
    rest.name = "rest";
    rest.opens[Direction::kExport][OpenedBy::kTopics] = {pattern("/**")};
    rest.opens[Direction::kImport][OpenedBy::kTopics] = {pattern("/**")};
    if (rng.chance(200)) rest.treatment = random_treatment(rng);
    if (rng.chance(500)) {  // pictures of cameras
      rest.treatment.compression = {.automatic = true};
      rest.treatment.lossy = Lossy::kAuto;
    }
    rules.push_back(std::move(rest));
  }
  return rules;
}

namespace {

void open_corner(Rule& corner) {
  corner.opens[Direction::kImport][OpenedBy::kTopics] =
      corner.opens[Direction::kExport][OpenedBy::kTopics] = {pattern("/hostile/**")};
  corner.opens[Direction::kImport][OpenedBy::kServices] =
      corner.opens[Direction::kExport][OpenedBy::kServices] = {pattern("/hostile/**")};
  corner.opens[Direction::kImport][OpenedBy::kActions] =
      corner.opens[Direction::kExport][OpenedBy::kActions] = {pattern("/hostile/**")};
  corner.opens[Direction::kImport][OpenedBy::kParameters] =
      corner.opens[Direction::kExport][OpenedBy::kParameters] = {pattern("/hostile/**")};
}

}  // namespace

// For a side that meets nobody but strangers.
Policy corner_for_all() {
  Rule corner;
  corner.name = "corner";
  open_corner(corner);
  return Policy{{corner}};
}

// What was for everybody is for the known people; a stranger may use a corner of its own.
Policy with_strangers(const Policy& policy) {
  std::vector<Rule> rules = policy.rules();
  for (auto& rule : rules) {
    if (rule.identities.empty() && rule.groups.empty()) rule.identities = {"ann", "bob0"};
  }
  Rule corner;
  corner.name = "corner";
  corner.identities = {kStranger};
  open_corner(corner);
  rules.push_back(std::move(corner));
  return Policy{std::move(rules)};
}

void add_resumption(Scenario& scenario) {
  Rng rng{scenario.seed ^ 0x2e5e11ULL};
  for (auto& host : scenario.hosts) {
    host.options.resume_for = rng.pick(std::vector<Duration>{0s, 1s, 2s, 4s});
    host.options.resume_bytes_max =
        static_cast<std::uint64_t>(rng.pick(std::vector<std::int64_t>{3000, 100'000, 16 << 20}));
  }
  scenario.steady = scenario.shape == Shape::kPair && rng.chance(500);
  if (!scenario.steady) return;
  scenario.later_policies.clear();
  scenario.crashes = false;
  scenario.clock_step = 0s;
  scenario.churn = 1h;
  scenario.weather = rng.between(200ms, 1500ms);
  scenario.chaos = rng.between(4s, 20s);
  for (auto& graph : scenario.graphs) graph.name_delay = 0s;
  for (auto& topic : scenario.topics) topic.latched = topic.mixed = false;
  for (auto& pair : scenario.pairs)
    pair.path.bytes_per_second = std::max<std::uint64_t>(pair.path.bytes_per_second, 1'000'000);
  for (auto& host : scenario.hosts) {
    host.options.resume_for = 30s;
    host.options.resume_bytes_max = 16 << 20;
  }
}

void add_caps(Scenario& scenario) {
  Rng rng{scenario.seed ^ 0xca9edULL};
  // What is published when all is quiet must still arrive in time.
  const std::vector<std::int64_t> caps = {400'000, 800'000, 2'000'000};
  for (auto& host : scenario.hosts)
    if (rng.chance(150))
      host.options.outbox.bytes_per_second_max = static_cast<std::uint64_t>(rng.pick(caps));
}

void add_relays(Scenario& scenario) {
  Rng rng{scenario.seed ^ 0x2e1a7ULL};
  for (PairPlan& pair : scenario.pairs) {
    if (!rng.chance(120)) continue;
    PathPlan& path = pair.path;
    path.relay_buffer = static_cast<std::size_t>(rng.between(4096, 65'536));
    path.relay_delay = rng.between(100us, 40ms);
    // Either leg may be the slower one, but not beyond what this scenario is made for.
    path.relay_bytes_per_second =
        path.bytes_per_second * static_cast<std::uint64_t>(rng.between(10, 40)) / 10;
    if (rng.chance(500)) std::swap(path.bytes_per_second, path.relay_bytes_per_second);
  }
}

void add_identities(Scenario& scenario) {
  Rng rng{scenario.seed ^ 0x1de27ULL};
  HostPlan& server = scenario.hosts[0];
  if (scenario.shape != Shape::kPair || scenario.accounts.size() != 1 || !rng.chance(150)) return;
  const std::string& name = scenario.accounts.begin()->second.name;
  scenario.by_identity = true;
  server.names.prefix = "/" + name;
  server.options.names = PeerNames({}, server.names.remap);
}

SideOptions random_options(Rng& rng, Role role, const PathPlan& path) {
  SideOptions o;
  o.matching = 60ms;
  o.role = role;
  o.reassembly.open_bytes_max = 64 << 20;
  o.dead_after = rng.between(1s, 3s);
  o.login_timeout = rng.between(1s, 5s);
  o.retry_min = rng.between(50ms, 300ms);
  o.retry_max = rng.between(300ms, 1500ms);
  o.default_depth = static_cast<std::uint32_t>(rng.pick(std::vector<int>{10, 100, 100}));
  o.latched_depth = static_cast<std::uint32_t>(rng.pick(std::vector<int>{3, 10, 10}));
  o.audits = true;
  o.compress_job_bytes = static_cast<std::uint32_t>(rng.pick(std::vector<int>{64, 2000, 16384}));
  // A fragment must not keep a thin line busy for so long that the peer seems silent.
  const auto fragment_max = std::clamp<std::int64_t>(
      static_cast<std::int64_t>(path.bytes_per_second / 16), 1024, 524'288);
  o.outbox.fragment_bytes = static_cast<std::uint32_t>(rng.between(1000, fragment_max));
  o.outbox.packet_bytes =
      static_cast<std::uint32_t>(rng.between(500, std::min<std::int64_t>(65536, fragment_max)));
  if (rng.chance(400)) {
    o.outbox.unacknowledged_bytes_max = static_cast<std::uint64_t>(rng.between(140'000, 400'000));
  }
  if (rng.chance(400)) {
    o.outbox.data_bytes_max = static_cast<std::uint64_t>(rng.between(20'000, 500'000));
  }
  if (rng.chance(300)) o.history_bytes_max = static_cast<std::uint64_t>(rng.between(2000, 200'000));
  if (role == Role::kServer && rng.chance(200)) {  // a client cannot tell a limit of its own
    o.reassembly.message_bytes_max = static_cast<std::uint32_t>(rng.between(3000, 50'000));
  }
  if (rng.chance(50)) o.clock_publish_period = 100ms;
  // Enough for what honest peers do: what is expected of them holds.
  if (rng.chance(100))
    o.account.memory_bytes_max = static_cast<std::uint64_t>(rng.between(64'000'000, 256'000'000));
  if (rng.chance(100)) o.account.mirrors_at_once = static_cast<int>(rng.between(1, 20));
  return o;
}

}  // namespace connect_bridge::sim
