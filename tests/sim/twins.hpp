// A small world of its own: two bridges stand in one graph. They start at about the same time, know
// of each other late, and one of them ends. Whatever the middleware tells of its endpoints, no call
// is executed twice, a message comes twice only while neither bridge can have heard the other, none
// is lost but where the origin passes from one to the other, and nothing comes back to where it was
// published.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "sim/small_world.hpp"

namespace connect_bridge::sim {

enum class TwinEnd : std::uint8_t { kStop, kCrash, kSilentCrash, kCut, kSilentCut };

// Drawn from a seed. Graph 0 is the robots', graph 1 the operators'.
struct TwinPlan {
  std::uint64_t seed = 0;
  bool two_servers = false;  // each client has a server of its own; else they share one
  bool tells_claimants = true;
  bool ids_show_process = true;
  bool tells_origins = true;
  Duration block_max{};  // of the bridges' publishers
  bool proxies = false;
  Duration name_delay{};
  Duration second_start{};  // after the first client's
  Duration meeting{};       // until the clients know of each other, after the second one's start
  TwinEnd end = TwinEnd::kStop;

  [[nodiscard]] std::string text() const;
};
TwinPlan make_twins(std::uint64_t seed);

class Twins final : public SmallWorld {
 public:
  Twins(const TwinPlan& plan, bool verbose);

  // Throws a Violation.
  void run();

 private:
  // One publisher and one subscriber in the other graph.
  struct Stream {
    int writer = 0, reader = 0;
    std::uint64_t published = 0;
    std::vector<std::uint64_t> heard;  // each once, in order
    TimePoint first_heard{};
  };
  // A service of the robots' graph, called from the operators'.
  struct Calls {
    int caller = 0;
    std::map<std::uint32_t, TimePoint> open;  // since when
    TimePoint first_answer{};
  };

  void build_bridge(Role role, int graph, Duration start, bool verbose);
  void build_quick_path(int client, int server);
  Stream make_stream(const std::string& topic, int from);
  void publish();
  void make_call();
  void end_feeder();
  [[nodiscard]] TimePoint second_start() const;
  // What is published at this moment may be fed by both.
  [[nodiscard]] bool may_come_twice(TimePoint published) const;
  void check_start() const;
  void check_end(const Stream& stream, std::uint64_t ended) const;
  void check_calls(TimePoint from) const;
  [[nodiscard]] Host& feeder();

  void on_heard(const Reader& reader, const Label& label) override;
  void on_answer(RequestKey key) override;

  TwinPlan plan_;
  std::map<int, int> path_of_;  // by client
  std::vector<Stream> streams_;
  Calls calls_;
};

}  // namespace connect_bridge::sim
