// The ordinary nodes that serve and call: they come, go, are replaced under the same name, answer
// late or never, and call in bursts.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "sim/call_check.hpp"
#include "sim/rng.hpp"
#include "sim/scenario.hpp"
#include "sim/server_work.hpp"
#include "sim/services.hpp"

namespace connect_bridge::sim {

class ServiceCrowd {
 public:
  ServiceCrowd(Schedule& schedule, Middleware& middleware, Services& services, CallCheck& check,
               const Scenario& scenario, Rng rng, bool verbose)
      : schedule_(schedule),
        middleware_(middleware),
        services_(services),
        check_(check),
        scenario_(scenario),
        rng_(rng),
        work_(schedule, services, check, rng_.fork()),
        verbose_(verbose),
        endpoints_max_(scenario.day ? 8 : 24) {}

  void start();
  // Nothing of that happens for a while.
  void pause(bool on) { paused_ = on; }
  // No node comes, goes or calls any more, except by the functions below; servers answer at once,
  // also requests that they had put off for ever.
  void calm();

  // Every caller that finds its service calls once. Returns how long that takes.
  Duration call_round(std::uint64_t known);
  // Some servers end, some begin.
  void shuffle();
  // From now on the callers are those that ask for goals' results, one in every graph, and servers
  // answer after `goal_time`.
  void ask_for_results(Duration goal_time);

  // Servers and callers that the middleware is about to forget, and what they had put off.
  void forget(TimePoint before);

  // From the services.
  void on_request(const Servant& servant, RequestKey key, const Payload& payload);
  void on_response(const Caller& caller, const Servant& servant, RequestKey key,
                   const Payload& payload);

  // Servers and callers that exist now; of an action all three servers, and its publishers.
  [[nodiscard]] std::vector<int> servants() const;
  [[nodiscard]] std::vector<int> action_writers() const;
  [[nodiscard]] const std::vector<int>& callers() const { return callers_; }
  [[nodiscard]] const ServicePlan& plan_of_servant(int id) const { return *servant_plans_.at(id); }
  [[nodiscard]] const ServicePlan& plan_of_caller(int id) const { return *caller_plans_.at(id); }
  [[nodiscard]] std::string local_name(int graph, const std::string& wire) const;

 private:
  EndpointSpec spec(const ServicePlan& plan, int graph, const std::string& node);
  void add_servant(const ServicePlan& plan, int graph, const std::string& node);
  void add_parts(const ServicePlan& plan, int servant);
  void remove_servant(std::size_t at, const char* why);
  void add_caller(const ServicePlan& plan, int graph);
  void remove_caller(std::size_t at);
  void restart_servant();
  void add_lasting(const ServicePlan& plan);
  void churn();
  void change();
  void tick(int caller);
  void call(int caller);
  void tell(const std::string& what, const EndpointSpec& spec) const;

  Schedule& schedule_;
  Middleware& middleware_;
  Services& services_;
  CallCheck& check_;
  const Scenario& scenario_;
  Rng rng_;
  ServerWork work_;
  bool verbose_;
  bool calm_ = false, paused_ = false;
  std::size_t endpoints_max_;
  std::set<int> lasting_servants_, lasting_callers_;
  // What a server has besides send_goal.
  struct Parts {
    std::vector<int> servants, writers;
  };
  std::vector<int> servants_, callers_;
  std::map<int, Parts> parts_;  // by the servant of send_goal
  std::map<int, const ServicePlan*> servant_plans_, caller_plans_;
  int last_node_ = 0;
};

}  // namespace connect_bridge::sim
