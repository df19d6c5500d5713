// Limits of topics; the operator sets some of them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/time.hpp"

namespace connect_bridge {

struct TopicOptions {
  // Depth of queues and mirrors if the graph gives none, and the least depth for reliable
  // publishers.
  std::uint32_t default_depth = 100;
  // The same for transient local: most middlewares do not report the number of samples that a
  // publisher keeps. Most publishers keep one; the others keep few.
  std::uint32_t latched_depth = 10;
  // Exported or imported messages may be kept over a break, even without a rule's `resume: true`.
  // The first is false at an operator, the second at a robot. So nothing older than the break moves
  // the robot, whatever the other end is set to.
  bool resumes_exported = true;
  bool resumes_imported = true;
  bool at_robot = false;                       // this side is the robot: imported commands drive it
  std::uint64_t resume_bytes_max = 16 << 20;   // of the backlog of one lost link
  std::uint64_t history_bytes_max = 64 << 20;  // transient-local samples kept for later links
  // Mirrors of one peer, 25 kB each; more than any robot has.
  std::uint32_t mirrors_max = 2048;
  std::uint32_t topic_mirrors_max = 256;  // of one peer and one topic
  std::uint32_t mirror_depth_max = 1000;  // most that a peer may request; a rule may request more
  std::uint64_t mirror_bytes_max = 256 << 20;   // kept by all transient-local mirrors of a peer
  std::uint64_t decoding_bytes_max = 64 << 20;  // of a peer's messages, for decompression
  // Time that the middleware takes until the present subscribers have found a new publisher. They
  // lose what it publishes before, so mirrors wait for this time.
  Duration matching = Duration::zero();
  Duration clock_publish_period = Duration::zero();  // > 0: publish the peer's ROS time on /clock
  bool pictures = false;                             // the workers encode and decode VP8
  // Peers that may give the time; without both lists any peer may. The first linked one gives it.
  std::vector<std::string> clock_identities{}, clock_groups{};
};

}  // namespace connect_bridge
