// What happens in a world, drawn from its seed: who is where, what they publish, which rules hold,
// how bad the weather is.
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
  std::size_t bytes_min = 0, bytes_max = 0;
  bool compressible = false;
  Duration period{};
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
  std::vector<Policy> later_policies;  // one may replace a host's own while the world runs
  Duration chaos{};                    // how long it is not quiet
  Duration churn{};                    // mean time between two changes of a graph
  Duration weather{};                  // mean time between two disturbances; 0: none
  Duration clock_step{};               // by which graph 0's clock is set once; 0: never
  bool crashes = false;                // processes end and start again
  Ending ending = Ending::kStop;

  [[nodiscard]] std::string text() const;
};

Scenario make_scenario(std::uint64_t seed);

// A random set of rules; most of it lets most topics through. Used by make_scenario().
std::vector<Rule> random_rules(Rng& rng);
inline constexpr char kStranger[] = "stranger";
Policy with_strangers(const Policy& policy);
Policy corner_for_all();
// Options in which every limit may be small.
SideOptions random_options(Rng& rng, Role role, const PathPlan& path);

}  // namespace connect_bridge::sim
