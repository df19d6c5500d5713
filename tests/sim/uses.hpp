// What people do on thin links: each use with what it must get, in a world of its own
// (sim/thin.hpp).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "sim/thin.hpp"

namespace connect_bridge::sim {

struct Use {
  std::string what;
  ThinPlan plan;
  std::function<void(const Thin&)> check;  // throws a Violation
};
std::vector<Use> uses();

}  // namespace connect_bridge::sim
