// Limits of topics; some of them the operator sets.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/time.hpp"

namespace connect_bridge {

struct TopicOptions {
  // Queue and mirror depth where the graph gives none, and the least one of reliable publishers.
  std::uint32_t default_depth = 100;
  // The same for transient local: most middlewares do not tell how many samples a publisher keeps,
  // and most keep one; who keeps more keeps few.
  std::uint32_t latched_depth = 10;
  // What this side exports, and what it imports, may be kept over a break also where no rule says
  // `resume: true`. The first is false at an operator, the second at a robot: nothing that is older
  // than the break moves it, whatever the other end says.
  bool resumes_exported = true;
  bool resumes_imported = true;
  std::uint64_t resume_bytes_max = 16 << 20;   // of what is kept for one lost link
  std::uint64_t history_bytes_max = 64 << 20;  // transient-local samples kept for later links
  // Of one peer, 25 kB each; more than any robot has.
  std::uint32_t mirrors_max = 2048;
  std::uint32_t topic_mirrors_max = 256;        // of one peer and one topic
  std::uint32_t mirror_depth_max = 1000;        // what a peer may ask for; a rule may ask for more
  std::uint64_t mirror_bytes_max = 256 << 20;   // what the transient-local mirrors of a peer keep
  std::uint64_t decoding_bytes_max = 64 << 20;  // of a peer's messages, for decompression
  // How long the middleware takes until the subscribers that are here have found a new publisher:
  // what it publishes before is lost to them, so mirrors wait with it.
  Duration matching = Duration::zero();
  Duration clock_publish_period = Duration::zero();  // > 0: publish the peer's ROS time on /clock
  // The peers whose time it may be; neither list: any peer. The first that is linked gives it.
  std::vector<std::string> clock_identities{}, clock_groups{};
};

}  // namespace connect_bridge
