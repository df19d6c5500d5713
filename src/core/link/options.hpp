// What the operator sets for one side.
#pragma once

#include <cstdint>
#include <string>

#include "core/base/time.hpp"
#include "core/jobs/jobs.hpp"
#include "core/link/links.hpp"
#include "core/policy/policy.hpp"

namespace connect_bridge {

// How the peers' names appear in the local graph.
struct GraphOptions {
  NameMap names;
  bool proxy_nodes = false;  // mirrors belong to a node named as their origin's, not to our own

  // The local node that shall own the mirror of something of the peer's `node` (a name on the
  // wire). Empty: our own node.
  [[nodiscard]] std::string owner_of(const std::string& node) const {
    return proxy_nodes && is_canonical_name(node) ? names.to_local(node) : std::string();
  }
};

struct TopicOptions {
  std::uint32_t default_depth = 100;           // queue and mirror depth where the graph gives none
  std::uint32_t latched_depth = 10;            // the same for transient local
  std::uint64_t history_bytes_max = 64 << 20;  // transient-local samples kept for later links
  std::uint32_t mirrors_max = 16384;           // of all peers together
  Duration clock_publish_period = Duration::zero();  // > 0: publish the peer's ROS time on /clock
};

// The sum of what its parts want to know; `config` fills it.
struct SideOptions : LinkOptions, JobOptions, GraphOptions, TopicOptions {
  Policy policy;
  std::uint32_t channels_max = 4096;  // offers accepted from one peer
  // Calls from one peer that real servers have at a time; more than those of one service, so that
  // one that never answers leaves room for the others.
  std::uint32_t calls_max = 256;
  std::uint32_t calls_waiting_max = 1000;   // calls from one peer that wait for their turn
  std::uint64_t call_bytes_max = 64 << 20;  // of requests, and of answers, kept for one peer
};

}  // namespace connect_bridge
