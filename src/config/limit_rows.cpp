#include "config/limit_rows.hpp"

#include "config/key_rows.hpp"

namespace connect_bridge {
namespace {

constexpr Duration kSecond = std::chrono::seconds(1);
constexpr char kOfALink[] = "Limits of a link";

// What one peer may offer, send and have waiting.
void add_link_limits(Rows& rows) {
  const auto add = row_adder(rows, kOfALink);
  const auto of_server = row_adder(rows, kOfALink, UsedBy::kServer);
  add("max_message_size", {1024, kGiB}, "bytes", "Largest message accepted from a peer.",
      [](Config& c) { return &c.limits.reassembly.message_bytes_max; });
  add("queue_bytes_max", {65536, 4 * kGiB}, "bytes",
      "All that waits to be sent on one link. Beyond it the oldest messages of "
      "the lowest priority are dropped and counted.",
      [](Config& c) { return &c.limits.outbox.data_bytes_max; });
  add("fragment_bytes", {1024, 1048576}, "bytes",
      "Largest part of a message that is sent in one piece. Parts follow the rate of "
      "the link, so a limit is needed only where urgent messages overtake too late: "
      "4096 to 16384 on thin links.",
      [](Config& c) { return &c.limits.outbox.fragment_bytes; });
  add("history_bytes_max", {0, 4 * kGiB}, "bytes",
      "Transient-local samples of one topic kept for links that come later.",
      [](Config& c) { return &c.limits.history_bytes_max; });
  add("default_depth", {1, 100000}, "messages",
      "Queue depth of a topic whose publishers show none in the graph (with most middlewares "
      "none does), and the least one of a topic with a reliable publisher, but for commands.",
      [](Config& c) { return &c.limits.default_depth; });
  add("latched_depth", {1, 100000}, "messages",
      "The same for transient-local topics (see \"Latched topics\").",
      [](Config& c) { return &c.limits.latched_depth; });
  add("channels_max", {1, 65536}, "", "Interfaces that one peer may offer.",
      [](Config& c) { return &c.limits.channels_max; });
  add("calls_max", {1, 1000}, "calls",
      "Calls of one peer under way at this side's servers, of all services "
      "together; the first of each service does not count, and later ones wait for their "
      "turn.",
      [](Config& c) { return &c.limits.calls_max; });
  of_server("connections_max", {1, 10000}, "",
            "Clients at the same time, including lost ones that may return.",
            [](Config& c) { return &c.limits.links_max; });
  of_server("connections_per_identity_max", {0, 10000}, "",
            "The same for one identity, so that one token cannot take all places. 0: "
            "half of connections_max, but at least 8.",
            [](Config& c) { return &c.limits.identity_links_max; });
}

// Limits of what a peer may create in this side's graph.
void add_mirror_limits(Rows& rows) {
  const auto add = row_adder(rows, kOfALink);
  add("mirrors_max", {1, 16384}, "",
      "Publishers of one peer that may exist here. Each takes some 25 kB at this side and in "
      "the processes that subscribe to it; further ones are left out and logged.",
      [](Config& c) { return &c.limits.mirrors_max; });
  add("topic_mirrors_max", {1, 1024}, "", "The same for one topic.",
      [](Config& c) { return &c.limits.topic_mirrors_max; });
  add("mirror_depth_max", {1, 100000}, "messages",
      "Depth that a peer may ask for; keep-all becomes this depth. A rule's qos.depth may "
      "be more.",
      [](Config& c) { return &c.limits.mirror_depth_max; });
  add("mirror_bytes_max", {1, 64 * kGiB}, "bytes",
      "Memory in which the middleware may keep samples of one peer's transient-local "
      "topics here for late subscribers, computed from the largest sample of each. If it "
      "is too small, fewer samples are kept than the depth says; a sample that does not "
      "fit is dropped and counted.",
      [](Config& c) { return &c.limits.mirror_bytes_max; });
}

// What all peers together, and those of one identity, may take, and what may appear here, come and
// go because of them.
void add_share(Rows& rows) {
  const AccountOptions account;
  const auto add = row_adder(rows, kOfALink);
  add("memory_max", {1 << 20, 1024 * kGiB}, "bytes",
      "Memory that all peers together may use at this side: unfinished messages, "
      "queues, calls, bases, histories. An identity that is alone can use half; with n "
      "greedy identities each gets 1/(n+1). The links of an identity share its part in "
      "the same way: a single link can use a third. What does not fit is dropped "
      "(`memory` in the status) or refused.",
      [](Config& c) { return &c.limits.account.memory_bytes_max; });
  add({.key = "mirrors_per_second",
       .fallback = kSecond / account.mirror_period,
       .range = NumberRange{1, 100000},
       .help =
           "Publishers and services that the peers of one identity may create here, after " +
           std::to_string(account.mirrors_at_once) +
           " at once, and as many subscriptions for what they listen to. Further ones are created "
           "later: each costs every process of the graph."});
  add("limits.channels_per_second", {1, 100'000}, "",
      "Channels that a peer withdraws or demands no longer, and publishers and listeners "
      "that it takes back; besides, attachments to services that all peers of one identity "
      "begin. A minute's worth passes at once, what is beyond ends the link (4006). Of all "
      "links of an identity together 5 times as many demands may end.",
      [](Config& c) { return &c.limits.account.channels_per_second; });
  add("limits.control_bytes_per_second", {65'536, kGiB}, "bytes",
      "Control messages of all links of one identity. What 8 seconds allow passes at once; "
      "beyond it the link ends that has sent most of them (4006).",
      [](Config& c) { return &c.limits.account.control_bytes_per_second; });
  add("limits.listeners_max", {0, 1024}, "",
      "Listeners of a peer that are subscribed for at a time; further ones wait until others "
      "end.",
      [](Config& c) { return &c.limits.listeners_max; });
  add("limits.services_max", {1, 1'000'000}, "",
      "Services of all peers together that appear here. No identity may have more than it "
      "leaves to the others; further ones appear when others end.",
      [](Config& c) { return &c.limits.account.services_max; });
}

// How fast peers are read.
void add_reading(Rows& rows) {
  const auto add = row_adder(rows, kOfALink);
  add("peer_packets_per_second", {0, 1'000'000'000}, "",
      "WebSocket messages that are read from a peer; beyond that reading pauses, and the "
      "peer has to wait (`reading_held` in the status). A burst of 4 seconds' worth passes "
      "at once. 0: no limit.",
      [](Config& c) { return &c.socket.receive_packets_per_second; });
  add("peer_bytes_per_second", {0, 1024 * kGiB}, "bytes",
      "The same in bytes. Of control messages 4 MiB a second are read in any "
      "case.",
      [](Config& c) { return &c.socket.receive_bytes_per_second; });
}

// All of these are counted in the status, and told to the log when they are reached.
void add_strangers(Rows& rows) {
  const AccountOptions account;
  const ListenOptions listen;
  const auto add = row_adder(rows, "Limits before login", UsedBy::kServer);
  add("limits.strangers_max", {8, 1000}, "",
      "Connections without a login. When there are so many, a new one ends the oldest. "
      "From half of them on a new one must show its login within a second.",
      [](Config& c) { return &c.limits.strangers_max; });
  add("limits.address_strangers_max", {1, 10'000}, "",
      "The same of one address. An address of the loopback, where a proxy mostly is, has "
      "8 times as many, and 8 times what the other limits here give to an address.",
      [](Config& c) { return &c.listen.pending_per_address_max; });
  add({.key = "limits.handshakes_per_second",
       .fallback = kSecond / listen.handshake_period,
       .range = NumberRange{1, 100'000},
       .help = "TLS handshakes that begin. What 3 seconds allow begins at once, what is beyond "
               "waits, and those who wait take turns."});
  add({.key = "limits.address_handshakes_per_second",
       .fallback = kSecond / listen.address_handshake_period,
       .range = NumberRange{1, 100'000},
       .help = "The same of one address, and twice that of the first 56 bits of an IPv6 address; "
               "what is beyond is dropped. What 3 seconds allow begins at once."});
  add("limits.wrong_logins_per_minute", {1, 1'000'000}, "",
      "Wrong logins that are answered at once; what is beyond is answered 3 seconds "
      "later. A right login is never counted, and let in at once.",
      [](Config& c) { return &c.limits.wrong_logins_at_once; });
  add("limits.address_wrong_logins_per_minute", {1, 1'000'000}, "", "The same of one address.",
      [](Config& c) { return &c.limits.address_wrong_logins_at_once; });
  add({.key = "limits.offences_per_minute",
       .fallback = 60 * kSecond / account.offence_period,
       .range = NumberRange{1, 1'000'000},
       .help =
           "How many links of one identity may be ended in a minute for what no peer may do (4002, "
           "4006, 4009, 4010); " +
           std::to_string(account.offences_at_once) +
           " of them at once. After more, its next login waits, or is refused, for at most a "
           "minute. Its links that have not offended go on after a break all the same."});
}

}  // namespace

void add_limit_rows(std::vector<KeySpec>& rows) {
  add_link_limits(rows);
  add_mirror_limits(rows);
  add_share(rows);
  add_reading(rows);
  add_strangers(rows);
}

}  // namespace connect_bridge
