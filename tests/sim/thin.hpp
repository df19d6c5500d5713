// A small world of its own: one link between a robot's graph and an operator's, on a path that
// carries less than is published, or is gone for a while. Of what tells a state nothing arrives
// that is older than the path explains.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "sim/small_world.hpp"

namespace connect_bridge::sim {

// Publishers of one topic, and a subscriber of it in the other graph.
struct ThinFlow {
  std::string topic, type;
  std::size_t bytes = 2000;
  Duration period{};
  int from = 0;  // 0: the robot's graph, with the server; 1: the operator's
  int publishers = 1;
  Qos qos{};
  Duration ends{};  // it is published until then; 0: to the end
};

struct ThinPlan {
  std::uint64_t seed = 1;
  PathPlan path;
  std::vector<ThinFlow> flows;
  Treatment treatment{};  // by the rules of both sides
  Duration end = std::chrono::seconds(13);
  Duration break_at{}, break_for{};  // for so long nothing arrives, and dials are refused
  Duration call_takes{};             // of one call to the robot's service, at 2 s; 0: there is none

  [[nodiscard]] std::string text() const;
};
// One to ten publishers of states of one size, which publish 0.7 to 10 times what the path carries.
ThinPlan make_thin(std::uint64_t seed);

class Thin final : public SmallWorld {
 public:
  explicit Thin(const ThinPlan& plan, bool verbose = false);

  struct Heard {
    std::uint64_t counter = 0;  // of its publisher, from 1
    TimePoint at{};
    Duration age{};
  };
  struct Stream {
    std::size_t flow = 0;
    int writer = 0;
    std::uint64_t published = 0;
    std::vector<Heard> heard;
  };

  // Throws a Violation.
  void run() { schedule_.run_until(TimePoint{} + plan_.end); }
  // Of make_thin(): what arrives is young, as much as the path carries, and each has its share.
  void check() const;
  [[nodiscard]] const std::vector<Stream>& streams() const { return streams_; }
  [[nodiscard]] const Coverage& coverage() const { return checker_.ledger().coverage(); }
  [[nodiscard]] int answers() const { return answers_; }
  // 1.5 times what two messages take on a share of the path, and the way, and 100 ms.
  [[nodiscard]] Duration age_max(std::size_t bytes, std::size_t sharing) const;
  // Of what arrived from then on.
  [[nodiscard]] static Duration age_p99(const Stream& stream, TimePoint from);

 private:
  void build_bridge(Role role, int graph, bool verbose);
  void add_flow(std::size_t index);
  void publish(std::size_t stream);
  void make_call();

  void on_heard(const Reader& reader, const Label& label) override;
  void on_answer(RequestKey) override { ++answers_; }

  ThinPlan plan_;
  int path_ = 0;
  std::vector<Stream> streams_;
  std::map<int, std::size_t> of_writer_;  // its stream
  int answers_ = 0;
};

}  // namespace connect_bridge::sim
