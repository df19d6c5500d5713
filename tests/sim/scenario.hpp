// The plan of a world, drawn from its seed: which nodes are where, what they publish, which rules
// apply, how bad the weather is.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/host.hpp"
#include "sim/middleware.hpp"
#include "sim/network.hpp"

namespace connect_bridge::sim {

enum class Shape : std::uint8_t {
  kPair,        // a server and a client, two graphs
  kStar,        // a server and two clients, three graphs
  kSharedStar,  // a server and two clients that share a graph
  kTwoBridges,  // two servers and two clients between the same two graphs
  kOneGraph,    // a server and a client in the same graph
  kHostile,     // a pair, and strangers who may log in and then do what they like
};
inline constexpr int kShapes = 6;

struct TopicPlan {
  std::string name, type, type_hash;
  std::vector<int> graphs;  // where it is published
  bool latched = false;     // publishers are transient local
  bool mixed = false;       // ... or not, as it comes
  bool lasting = false;     // one publisher and one subscriber stay, and all publishers are alike
  std::size_t bytes_min = 0, bytes_max = 0;
  bool compressible = false;
  Duration period{};
};

// A service, or an action: then this is its send_goal, and the server has the other parts, too.
struct ServicePlan {
  std::string name, type, type_hash;
  std::string action;          // "/fib", empty for a service
  std::vector<int> graphs;     // where it is served
  std::int64_t bytes_max = 0;  // of a request and of a response
  bool compressible = false;
  bool one_by_one = false;      // the server does not begin a call before it has ended another
  Duration work_max{};          // until it answers
  unsigned never_permille = 0;  // calls that it does not answer while it is not quiet
  unsigned away_permille = 0;   // how often nobody looks after its queue
  Duration away_max{};          // ... for how long
  Duration period{};            // between two bursts of a caller
  std::int64_t burst_max = 0;
  bool lasting = false;  // one server stays, and one caller in every other graph
};

struct PairPlan {
  int client = 0, server = 0;  // hosts
  PathPlan path;
  bool may_log_in = true;
};

enum class Ending : std::uint8_t { kStop, kSilence, kCrash };

struct Scenario {
  std::uint64_t seed = 0;
  Shape shape = Shape::kPair;
  std::vector<GraphPlan> graphs;
  std::vector<HostPlan> hosts;
  std::vector<PairPlan> pairs;
  Accounts accounts;
  std::vector<TopicPlan> topics;
  std::vector<ServicePlan> services;
  std::vector<Policy> later_policies;  // one may replace a host's own while the world runs
  Duration chaos{};                    // how long it is not quiet
  Duration churn{};                    // mean time between two changes of a graph
  Duration weather{};                  // mean time between two disturbances; 0: none
  Duration clock_step{};               // by which graph 0's clock is set once; 0: never
  bool crashes = false;                // processes end and start again
  bool long_goals = false;             // at last, goals that take an hour
  bool day = false;                    // it goes on for 24 hours
  bool steady = false;                 // nothing changes but the weather: nothing may be missing
  bool by_identity = false;            // the first server puts names below identities
  Ending ending = Ending::kStop;

  [[nodiscard]] std::string text() const;
  // Long enough for the bytes to be through before what comes next. When all is quiet the paths are
  // fast, but a sender may still know them as they were (`known`, bytes per second): it looks for
  // more rate only while it has something to send.
  [[nodiscard]] Duration time_to_send(std::uint64_t bytes, std::uint64_t known) const;
};

Scenario make_scenario(std::uint64_t seed);
// A steady pair of sides for a day (sim/day.hpp).
Scenario make_day(std::uint64_t seed);

// Of a text that is right.
Pattern pattern(const std::string& text);
// A random set of rules; most of it lets most topics through. Used by make_scenario().
std::vector<Rule> random_rules(Rng& rng);
// Services, with their part of the rules and of the limits. What make_scenario() has drawn for
// topics stays as it is.
void add_services(Scenario& scenario);
// What the sides keep for a lost link, and which worlds are steady. The rest does not change.
void add_resumption(Scenario& scenario);
// Some sides may send so many bytes per second only.
void add_caps(Scenario& scenario);
// Some pairs meet at a relay.
void add_relays(Scenario& scenario);
// Some servers have the names of who logs in below its identity.
void add_identities(Scenario& scenario);
Policy with_strangers(const Policy& policy);
Policy corner_for_all();
// Options in which every limit may be small.
SideOptions random_options(Rng& rng, Role role, const PathPlan& path);

}  // namespace connect_bridge::sim
