// The fake ROS middleware: graphs of publishers and subscribers that find each other, with the
// matching rules of DDS, history for late joiners, and snapshots of the graph.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/ports/ports.hpp"
#include "sim/rng.hpp"
#include "sim/roster.hpp"
#include "sim/schedule.hpp"

namespace connect_bridge::sim {

// The system clock of a graph's machine: wrong by an offset and a drift.
struct MachineClock {
  Stamp offset = 0;            // at the start of the world, ns
  std::int64_t drift_ppb = 0;  // parts per billion
  [[nodiscard]] Stamp at(TimePoint t) const {
    constexpr Stamp kStart = 1'700'000'000'000'000'000;
    const std::int64_t ns = t.time_since_epoch().count();
    return kStart + offset + ns + ns / 1'000'000 * drift_ppb / 1000;
  }
};

struct GraphPlan {
  MachineClock clock;
  bool tells_depth = true;       // whether the graph shows the depth of a publisher's history
  bool tells_servers = true;     // whether it shows the gids of service servers
  Duration discovery_max{};      // until two endpoints have found each other
  Duration name_delay{};         // until the graph knows the name of an endpoint's node
  unsigned loss_permille = 0;    // of best-effort samples
  bool tells_claimants = true;   // whether a sample of the bridges' own topic tells its publisher
  bool ids_show_process = true;  // whether the gids of a process begin alike
  bool tells_origins = true;     // whether any sample tells its publisher and its number
  Duration block_max{};  // 0: no publisher of a bridge ever blocks; else some do, for so long
  std::vector<std::string> unknown_types;  // entities of these types cannot be created
};

struct EndpointSpec {
  int graph = 0;
  std::string topic, type, type_hash;
  std::string node_namespace, node_name;
  Qos qos;
  int host = -1;             // the bridge's process that owns it; -1: an ordinary node
  std::uint32_t handle = 0;  // that process's number for it
};

inline constexpr unsigned kBlocksPermille = 10;

// Of one bridge.
inline bool same_process(const EndpointSpec& a, const EndpointSpec& b) {
  return a.host >= 0 && a.host == b.host;
}

struct Sample {
  Payload payload;
  Stamp stamp = 0;
  std::uint64_t number = 0;  // counts those of its writer, from 1
  TimePoint published{};
};

struct Reader {
  EndpointSpec spec;
  int id = 0;
  Gid gid;
  bool alive = true;
  TimePoint created{}, destroyed{};
};

struct Writer {
  struct Match {
    int reader = 0;
    TimePoint last_delivery{};
  };
  EndpointSpec spec;
  int id = 0;
  Gid gid;
  bool alive = true;
  TimePoint created{}, destroyed{};
  std::uint64_t count = 0;  // samples published
  Stamp last_stamp = 0;
  std::deque<Sample> history;
  std::vector<Match> matches;
};

// Whether a reader with `requested` gets data of a writer with `offered` (DDS 1.4, table 2.2.3).
bool compatible(const Qos& offered, const Qos& requested);

class Middleware {
 public:
  class Listener {
   public:
    virtual ~Listener() = default;
    virtual void on_delivery(const Reader& reader, const Writer& writer, const Sample& sample) = 0;
    virtual void on_graph_change(int graph) = 0;
  };

  Middleware(Schedule& schedule, std::vector<GraphPlan> graphs, Rng rng, Listener& listener);

  int create_writer(EndpointSpec spec);
  int create_reader(EndpointSpec spec);
  void destroy_writer(int id);
  void destroy_reader(int id);
  void publish(int writer, Payload payload);

  // The graph as the process `host` sees it: without its own endpoints.
  [[nodiscard]] GraphChanged snapshot(int graph, int host) const;

  [[nodiscard]] const Writer& writer(int id) const { return writers_[id]; }
  [[nodiscard]] const Reader& reader(int id) const { return readers_[id]; }
  [[nodiscard]] const Roster<Writer>& writers() const { return writers_; }
  [[nodiscard]] const Roster<Reader>& readers() const { return readers_; }
  [[nodiscard]] bool knows_type(int graph, const std::string& type) const;
  [[nodiscard]] std::optional<TypeLack> lack_of(int graph, const std::string& type) const;
  [[nodiscard]] Stamp stamp(int graph) const;
  // By ordinary nodes.
  [[nodiscard]] std::uint64_t published() const { return published_; }
  [[nodiscard]] const GraphPlan& graph(int i) const { return graphs_[index(i)]; }
  // Somebody sets a machine's clock.
  void step_clock(int graph, Duration by) { graphs_[index(graph)].clock.offset += by.count(); }
  // Two processes of the bridge in one graph do not know of each other before.
  void meet(int host, int other, TimePoint when);
  // Of best-effort samples, from now on.
  void lose(int graph, unsigned permille) { graphs_[index(graph)].loss_permille = permille; }
  // Endpoints that ended before.
  void forget(TimePoint before);
  // From now on nothing is lost.
  void calm();
  // What was lost before does not matter any more.
  void forgive() { losses_.assign(losses_.size(), 0); }
  // Whether best-effort samples were ever lost in this graph.
  [[nodiscard]] bool has_lost(int graph) const { return losses_[index(graph)] > 0; }
  // For an endpoint that is made elsewhere.
  Gid new_gid(const EndpointSpec& spec);

 private:
  static std::size_t index(int id) { return static_cast<std::size_t>(id); }
  void announce(const EndpointSpec& spec);
  [[nodiscard]] TimePoint meeting(int host, int other) const;
  void plan_match(const Writer& writer, const Reader& reader);
  void match(Writer& writer, const Reader& reader);
  void deliver(const Writer& writer, Writer::Match& match, const Sample& sample);

  Schedule& schedule_;
  std::vector<GraphPlan> graphs_;
  Rng rng_;
  Listener& listener_;
  Roster<Writer> writers_;
  Roster<Reader> readers_;
  std::uint64_t published_ = 0;
  std::vector<std::uint64_t> losses_;                  // by graph
  std::map<std::pair<int, int>, TimePoint> meetings_;  // of hosts, the smaller first
  // The first 12 bytes are those of a process's endpoints.
  struct Participant {
    Gid gid;
    TimePoint used{};
    bool bridge = false;
  };
  std::map<std::string, Participant> participants_;  // by node
};

}  // namespace connect_bridge::sim
