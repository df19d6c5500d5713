// The nodes of the corner that strangers may use (names below /hostile/): servers that strangers
// call, callers of what strangers offer, and a topic.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "sim/label.hpp"
#include "sim/ledger.hpp"
#include "sim/middleware.hpp"
#include "sim/rng.hpp"
#include "sim/schedule.hpp"
#include "sim/services.hpp"

namespace connect_bridge::sim {

// The first label of strangers' requests. The counter is the epoch and the number of the
// call.
inline constexpr std::uint32_t kStrangerLabels = 1U << 30;

// Strangers may send any bytes as a request or an answer here, so that these are not looked at; but
// what one has labelled is executed at most once, and each answer is given at most once.
class Corner {
 public:
  Corner(Schedule& schedule, Middleware& middleware, Services& services, Coverage& coverage,
         Rng rng)
      : schedule_(schedule),
        middleware_(middleware),
        services_(services),
        coverage_(coverage),
        rng_(rng) {}

  void start(int graphs);
  // All of them end, and none comes any more.
  void stop();

  void on_request(const Servant& servant, RequestKey key, const Payload& payload);
  void on_response(const Caller& caller, const Servant& servant, RequestKey key);

 private:
  static EndpointSpec spec(int graph, const std::string& name, const std::string& type);
  void add_servant(int graph, const std::string& name);
  void churn();
  void tick(int caller);

  Schedule& schedule_;
  Middleware& middleware_;
  Services& services_;
  Coverage& coverage_;
  Rng rng_;
  bool stopped_ = false;
  std::vector<int> servants_, callers_, writers_;
  std::uint32_t calls_ = 0;
  std::set<std::tuple<int, std::uint32_t, std::uint64_t>> executed_;  // servant, label
  std::set<std::tuple<int, std::uint32_t, int>> answered_;            // caller, number, servant
};

}  // namespace connect_bridge::sim
