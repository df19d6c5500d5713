// What small worlds of their own have in common: bridges between two graphs, and users of whom each
// is checked as in the large one.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sim/checker.hpp"
#include "sim/host.hpp"

namespace connect_bridge::sim {

class SmallWorld : Middleware::Listener, Services::Listener {
 public:
  ~SmallWorld() override = default;
  SmallWorld(const SmallWorld&) = delete;
  SmallWorld& operator=(const SmallWorld&) = delete;

  [[nodiscard]] std::uint64_t digest() const { return digest_.value(); }

 protected:
  // Both graphs are as `graph`. `overlaps`: as the Checker has it.
  SmallWorld(std::uint64_t seed, const GraphPlan& graph, bool overlaps)
      : SmallWorld(seed, std::vector{graph, graph}, overlaps) {}
  SmallWorld(std::uint64_t seed, std::vector<GraphPlan> graphs, bool overlaps);

  // Everything may cross.
  static Rule everything();
  // Of a bridge of this graph, with quick workers and dials, and what others have by default.
  static HostPlan plan_of(Role role, int graph);
  void build_host(const HostPlan& plan, bool verbose);
  // Between two hosts, of which the first one dials; returns its number.
  int build_path(int client, int server, const PathPlan& plan);
  // A server in graph 0 that answers after this time, and a caller in graph 1; returns the caller.
  int build_service(const std::string& name, const std::string& type, Duration takes = {});
  // Returns the call's number.
  std::uint32_t call(int caller);

  // A user's subscriber got what is right so far; and a user's caller.
  virtual void on_heard(const Reader& reader, const Label& label) = 0;
  virtual void on_answer(RequestKey key) = 0;

  Schedule schedule_;
  Rng rng_;
  Middleware middleware_;
  Services services_;
  Network network_;
  Checker checker_;
  Accounts accounts_;
  Digest digest_;
  std::vector<std::unique_ptr<Host>> hosts_;

 private:
  void on_delivery(const Reader& reader, const Writer& writer, const Sample& sample) override;
  void on_graph_change(int graph) override;
  void on_request(const Servant& servant, RequestKey key, const Payload& payload) override;
  void on_response(const Caller& caller, const Servant& servant, RequestKey key,
                   const Payload& payload) override;
  void on_found(const Caller& caller) override;
  void on_caller_gone(const Caller& caller) override;
  void on_services_change(int graph) override { on_graph_change(graph); }

  Duration answer_takes_{};
};

}  // namespace connect_bridge::sim
