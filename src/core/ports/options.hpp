// What the operator sets for one side.
#pragma once

#include <functional>
#include <string>

#include "core/base/bytes.hpp"
#include "core/base/time.hpp"
#include "core/flow/outbox.hpp"
#include "core/flow/reassembly.hpp"
#include "core/policy/policy.hpp"

namespace connect_bridge {

enum class Role : std::uint8_t { kServer, kClient };

struct SideOptions {
  Role role = Role::kServer;
  std::string node = "/connect";  // fully qualified name of our node
  Policy policy;
  NameMap names;
  std::string login_method = "none";  // client: what it logs in with
  Bytes credential;                   // client
  bool login_required = true;         // server: a login of method "none" is refused
  Duration login_timeout = std::chrono::seconds(5);
  Duration dead_after = std::chrono::seconds(3);
  Duration retry_min = std::chrono::milliseconds(200);  // client: first back-off
  Duration retry_max =
      std::chrono::milliseconds(1500);  // client: longest back-off (jitter included)
  Duration dial_timeout = std::chrono::seconds(5);
  std::uint32_t default_depth = 100;           // queue and mirror depth where the graph gives none
  std::uint32_t latched_depth = 10;            // the same for transient local
  std::uint32_t compress_job_bytes = 16384;    // from this size on compression is given to a worker
  std::uint64_t history_bytes_max = 64 << 20;  // transient-local samples kept for later links
  std::uint32_t links_max = 64;                // server
  std::uint32_t mirrors_max = 16384;           // of all peers together
  std::uint32_t channels_max = 4096;           // offers accepted from one peer
  // Calls from one peer that real servers have at a time; more than those of one service, so that
  // one that never answers leaves room for the others.
  std::uint32_t calls_max = 256;
  std::uint32_t calls_waiting_max = 1000;   // calls from one peer that wait for their turn
  std::uint64_t call_bytes_max = 64 << 20;  // of requests, and of answers, kept for one peer
  bool proxy_nodes = false;  // mirrors belong to a node named as their origin's, not to our own
  Duration clock_publish_period = Duration::zero();  // > 0: publish the peer's ROS time on /clock
  // Source of session secrets; the seeded generator when empty (simulation). Give it a
  // cryptographic one.
  std::function<std::uint64_t()> secret_random;
  OutboxOptions outbox;
  ReassemblyOptions reassembly;
};

}  // namespace connect_bridge
