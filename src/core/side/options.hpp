// Settings of one side, from the operator.
#pragma once

#include <cstdint>

#include "core/graph/options.hpp"
#include "core/jobs/jobs.hpp"
#include "core/link/options.hpp"
#include "core/policy/policy.hpp"
#include "core/services/options.hpp"
#include "core/topics/options.hpp"

namespace connect_bridge {

// The options of all parts of a side; `config` fills them.
struct SideOptions : LinkOptions, JobOptions, GraphOptions, TopicOptions, ServiceOptions {
  Policy policy;
  bool audits = false;                // whether audit lines are made
  bool drive_switch = false;          // the side has an operator, and the service ~/drive
  std::string robot;                  // as in Accepts; empty: not said
  std::uint32_t channels_max = 4096;  // offers accepted from one peer
};

}  // namespace connect_bridge
