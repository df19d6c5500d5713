// Disturbances of the network and the processes during the chaos.
#pragma once

#include <memory>
#include <vector>

#include "sim/host.hpp"
#include "sim/network.hpp"
#include "sim/rng.hpp"
#include "sim/scenario.hpp"

namespace connect_bridge::sim {

class Weather {
 public:
  Weather(Schedule& schedule, Network& network, std::vector<std::unique_ptr<Host>>& hosts,
          const Scenario& scenario, Rng rng, bool verbose);

  void start();
  // Everything works from now on: the lines are fast, all processes run.
  void heal();

 private:
  void next();
  void disturb_path(int path);
  void disturb_relay(int path);
  void refuse(int path, Duration how_long);
  void crash(Host& host);
  void change_rules();

  Schedule& schedule_;
  Network& network_;
  std::vector<std::unique_ptr<Host>>& hosts_;
  const Scenario& scenario_;
  Rng rng_;
  bool verbose_;
  bool healed_ = false;
};

}  // namespace connect_bridge::sim
