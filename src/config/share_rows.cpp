#include "config/share_rows.hpp"

#include <string>
#include <utility>

namespace connect_bridge {
namespace {

constexpr char kShareSection[] = "Limits of a link";

// What may appear here, come and go, and be said because of peers.
void add_limits(std::vector<KeySpec>& rows, const SideOptions& core) {
  const auto add_row = section_adder(rows, kShareSection);
  const auto add = [&](std::string key, std::int64_t fallback, double min, double max,
                       std::string unit, std::string help) {
    add_row({.key = std::move(key),
             .fallback = fallback,
             .range = NumberRange{min, max},
             .unit = std::move(unit),
             .help = std::move(help)});
  };
  add("limits.channels_per_second", core.account.channels_per_second, 1, 100'000, "",
      "Channels that a peer withdraws or demands no longer, and publishers and listeners "
      "that it takes back; besides, attachments to services that all peers of one identity "
      "begin. A minute's worth passes at once, what is beyond ends the link (4006). Of all "
      "links of an identity together 5 times as many demands may end.");
  add("limits.control_bytes_per_second",
      static_cast<std::int64_t>(core.account.control_bytes_per_second), 65'536, kGiB, "bytes",
      "Control messages of all links of one identity. What 64 seconds allow passes at once; "
      "beyond it the link ends that has sent most of them (4006).");
  add("limits.listeners_max", core.listeners_max, 0, 1024, "",
      "Listeners of a peer that are subscribed for at a time; further ones wait until others "
      "end.");
  add("limits.services_max", static_cast<std::int64_t>(core.account.services_max), 1, 1'000'000, "",
      "Services of all peers together that appear here. No identity may have more than it "
      "leaves to the others; further ones appear when others end.");
}

}  // namespace

// What all peers together, and those of one identity, may take.
void add_share_rows(std::vector<KeySpec>& rows, const SideOptions& core) {
  const auto add = section_adder(rows, kShareSection);
  add({.key = "memory_max",
       .fallback = static_cast<std::int64_t>(core.account.memory_bytes_max),
       .range = NumberRange{1 << 20, 1024 * kGiB},
       .unit = "bytes",
       .help = "Memory that all peers together may use at this side: unfinished messages, "
               "queues, calls, bases, histories. No identity may use more than it leaves to "
               "the others, and no link of an identity more than it leaves to its other "
               "links: a single link may use a third. What does not fit is dropped "
               "(`memory` in the status) or refused."});
  add({.key = "mirrors_per_second",
       .fallback = Duration(std::chrono::seconds(1)) / core.account.mirror_period,
       .range = NumberRange{1, 100000},
       .help =
           "Publishers and services that the peers of one identity may create here, after " +
           std::to_string(core.account.mirrors_at_once) +
           " at once, and as many subscriptions for what they listen to. Further ones are created "
           "later: each costs every process of the graph."});
  add_limits(rows, core);
  add({.key = "peer_packets_per_second",
       .fallback = std::int64_t{50'000},
       .range = NumberRange{0, 1'000'000'000},
       .help =
           "WebSocket messages that are read from a peer; beyond that reading pauses, and the "
           "peer has to wait (`reading_held` in the status). A burst of 4 seconds' worth passes "
           "at once. 0: no limit."});
  add({.key = "peer_bytes_per_second",
       .fallback = std::int64_t{0},
       .range = NumberRange{0, 1024 * kGiB},
       .unit = "bytes",
       .help = "The same in bytes. Of control messages 4 MiB a second are read in any "
               "case."});
}

}  // namespace connect_bridge
