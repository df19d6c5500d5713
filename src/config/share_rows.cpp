#include "config/share_rows.hpp"

#include <string>

namespace connect_bridge {
namespace {

constexpr double kGiB = 1 << 30;

ParameterValue whole(std::int64_t value) {
  return value;
}

}  // namespace

// What all peers together, and those of one identity, may take.
void add_share_rows(std::vector<KeySpec>& rows, const SideOptions& core) {
  const std::string section = "Limits of a link";
  rows.push_back({.section = section,
                  .key = "memory_max",
                  .type = ParameterType::kInteger,
                  .fallback = whole(static_cast<std::int64_t>(core.account.memory_bytes_max)),
                  .min = 1 << 20,
                  .max = 1024 * kGiB,
                  .unit = "bytes",
                  .help =
                      "Memory that all peers together may use at this side: unfinished messages, "
                      "queues, calls, bases, histories. No identity may use more than it leaves to "
                      "the others, and no link of an identity more than it leaves to its other "
                      "links: a single link may use a third. What does not fit is dropped "
                      "(`memory` in the status) or refused."});
  rows.push_back(
      {.section = section,
       .key = "mirrors_per_second",
       .type = ParameterType::kInteger,
       .fallback = whole(Duration(std::chrono::seconds(1)) / core.account.mirror_period),
       .min = 1,
       .max = 100000,
       .help =
           "Publishers and services that the peers of one identity may create here, after " +
           std::to_string(core.account.mirrors_at_once) +
           " at once, and as many subscriptions for what they listen to. Further ones are created "
           "later: each costs every process of the graph."});
  rows.push_back(
      {.section = section,
       .key = "peer_packets_per_second",
       .type = ParameterType::kInteger,
       .fallback = whole(50'000),
       .min = 0,
       .max = 1'000'000'000,
       .help =
           "WebSocket messages that are read from a peer; beyond that reading pauses, and the "
           "peer has to wait (`reading_held` in the status). A burst of 4 seconds' worth passes "
           "at once. 0: no limit."});
  rows.push_back({.section = section,
                  .key = "peer_bytes_per_second",
                  .type = ParameterType::kInteger,
                  .fallback = whole(0),
                  .min = 0,
                  .max = 1024 * kGiB,
                  .unit = "bytes",
                  .help = "The same in bytes. Of control messages 4 MiB a second are read in any "
                          "case."});
}

}  // namespace connect_bridge
