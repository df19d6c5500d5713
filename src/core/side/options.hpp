// What the operator sets for one side.
#pragma once

#include <cstdint>

#include "core/graph/options.hpp"
#include "core/jobs/jobs.hpp"
#include "core/link/options.hpp"
#include "core/policy/policy.hpp"
#include "core/services/options.hpp"
#include "core/topics/options.hpp"

namespace connect_bridge {

// The options of all its parts; `config` fills it.
struct SideOptions : LinkOptions, JobOptions, GraphOptions, TopicOptions, ServiceOptions {
  Policy policy;
  bool audits = false;                // whether lines of the audit log are made
  std::uint32_t channels_max = 4096;  // offers accepted from one peer
};

}  // namespace connect_bridge
