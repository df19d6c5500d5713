#include "config/key_table.hpp"

#include "config/audit_rows.hpp"
#include "config/login_rows.hpp"
#include "config/reach_rows.hpp"
#include "config/rule_rows.hpp"
#include "config/share_rows.hpp"
#include "config/stranger_rows.hpp"
#include "config/syntax.hpp"
#include "core/base/time.hpp"

namespace connect_bridge {
namespace {

using namespace syntax;  // NOLINT: a table reads better without the repeated word
using Strings = std::vector<std::string>;
using Rows = std::vector<KeySpec>;

double seconds(Duration duration) {
  return std::chrono::duration<double>(duration).count();
}
ParameterValue whole(std::uint64_t value) {
  return static_cast<std::int64_t>(value);
}

void add_tls(Rows& rows) {
  const auto add = section_adder(rows, "TLS");
  add({.key = "tls.certificate",
       .syntax = check_not_empty,
       .help = "File with this side's certificate chain (PEM). With it a server speaks "
               "TLS only; a client shows it to servers that ask."});
  add({.key = "tls.private_key",
       .syntax = check_not_empty,
       .help = "File with the private key of the certificate (PEM)."});
  add({.key = "tls.ca",
       .syntax = check_not_empty,
       .help = "File with the certificates to trust (PEM). Client: in place of the "
               "system's. Server: every client must show one that they signed."});
  add({.key = "tls.server_name",
       .syntax = check_not_empty,
       .used_by = UsedBy::kClient,
       .help = "Name that the server's certificate must carry, where it is not the "
               "host of the URL."});
  add({.key = "tls.pin",
       .fallback = Strings{},
       .syntax = check_pin,
       .used_by = UsedBy::kClient,
       .help = "SHA-256 of the public keys that the server may have, in base64. With "
               "tls.ca both must hold; without it the key alone decides, and the "
               "certificate may be self-signed, expired or for another name."});
}

void add_names(Rows& rows) {
  const auto add = section_adder(rows, "Names at this side");
  add({.key = "prefix",
       .fallback = "",
       .syntax = check_prefix,
       .help = "Put before every name of the peer, so that several robots can be used side by "
               "side: /scan becomes /robot1/scan. Of this side only names below it can be "
               "exported; the peer sees them without it. Rules have names without it."});
  add({.key = "remap",
       .fallback = Strings{},
       .syntax = check_remap,
       .help = "Single names that differ, each \"wire:=local\"; they win over prefix."});
  add({.key = "graph",
       .words = {"merged", "nodes"},
       .help = "Who owns what is imported. `merged`: this node. `nodes`: a node for each "
               "of the peer's, with its name, so that `ros2 node`, `ros2 param` and `ros2 "
               "lifecycle` find it. Unset: `nodes` at a client, `merged` at a server."});
}

void add_operation(Rows& rows) {
  const auto add = section_adder(rows, "Operation");
  add({.key = "status_file",
       .syntax = check_not_empty,
       .help = "File in which this side keeps its status as JSON, once a second: links, "
               "clock, and per topic messages, bytes, latency and drops by reason."});
  add({.key = "usage_file",
       .syntax = check_not_empty,
       .help = "File in which this side counts the bytes that it costs on the network, "
               "by day, over restarts. Without it they are counted since the start; "
               "the status shows today's and this month's."});
  add({.key = "types_not_installed",
       .fallback = "carry",
       .words = {"carry", "refuse"},
       .help = "Interfaces whose type's package is not installed at this side. `carry`: "
               "their messages are carried, and unchecked until the peer has described "
               "the type. `refuse`: only what can be checked reaches a node."});
}

void add_link_limits(Rows& rows, const SideOptions& core) {
  const auto add = section_adder(rows, "Limits of a link");
  add({.key = "max_message_size",
       .fallback = whole(core.reassembly.message_bytes_max),
       .range = NumberRange{1024, kGiB},
       .unit = "bytes",
       .help = "Largest message accepted from a peer."});
  add({.key = "queue_bytes_max",
       .fallback = whole(core.outbox.data_bytes_max),
       .range = NumberRange{65536, 4 * kGiB},
       .unit = "bytes",
       .help = "All that waits to be sent on one link. Beyond it the oldest messages of "
               "the lowest priority are dropped and counted."});
  add({.key = "fragment_bytes",
       .fallback = whole(core.outbox.fragment_bytes),
       .range = NumberRange{1024, 1048576},
       .unit = "bytes",
       .help = "Largest part of a message that is sent in one piece. Parts follow the rate of "
               "the link, so a limit is needed only where urgent messages overtake too late: "
               "4096 to 16384 on thin links."});
  add({.key = "history_bytes_max",
       .fallback = whole(core.history_bytes_max),
       .range = NumberRange{0, 4 * kGiB},
       .unit = "bytes",
       .help = "Transient-local samples of one topic kept for links that come later."});
  add({.key = "default_depth",
       .fallback = whole(core.default_depth),
       .range = NumberRange{1, 100000},
       .unit = "messages",
       .help = "Queue depth where the graph does not show one."});
  add({.key = "latched_depth",
       .fallback = whole(core.latched_depth),
       .range = NumberRange{1, 100000},
       .unit = "messages",
       .help = "The same for transient-local topics."});
}

// Limits of what a peer may create in this side's graph.
void add_mirror_limits(Rows& rows, const SideOptions& core) {
  const auto add = section_adder(rows, "Limits of a link");
  add({.key = "mirrors_max",
       .fallback = whole(core.mirrors_max),
       .range = NumberRange{1, 16384},
       .help =
           "Publishers of one peer that may exist here. Each takes some 25 kB at this side and in "
           "the processes that subscribe to it; further ones are left out and logged."});
  add({.key = "topic_mirrors_max",
       .fallback = whole(core.topic_mirrors_max),
       .range = NumberRange{1, 1024},
       .help = "The same for one topic."});
  add({.key = "mirror_depth_max",
       .fallback = whole(core.mirror_depth_max),
       .range = NumberRange{1, 100000},
       .unit = "messages",
       .help = "Depth that a peer may ask for; keep-all becomes this depth. A rule's qos.depth may "
               "be more."});
  add({.key = "mirror_bytes_max",
       .fallback = whole(core.mirror_bytes_max),
       .range = NumberRange{1, 64 * kGiB},
       .unit = "bytes",
       .help = "Memory in which the middleware may keep samples of one peer's transient-local "
               "topics here for late subscribers, computed from the largest sample of each. If it "
               "is too small, fewer samples are kept than the depth says; a sample that does not "
               "fit is dropped and counted."});
}

// Limits of numbers per peer.
void add_numbers(Rows& rows, const SideOptions& core) {
  const auto add = section_adder(rows, "Limits of a link");
  add({.key = "channels_max",
       .fallback = whole(core.channels_max),
       .range = NumberRange{1, 65536},
       .help = "Interfaces that one peer may offer."});
  add({.key = "calls_max",
       .fallback = whole(core.calls_max),
       .range = NumberRange{1, 1000},
       .unit = "calls",
       .help = "Calls of one peer under way at this side's servers, of all services "
               "together; later ones wait for their turn."});
  add({.key = "connections_max",
       .fallback = whole(core.links_max),
       .range = NumberRange{1, 10000},
       .used_by = UsedBy::kServer,
       .help = "Clients at the same time, including lost ones that may return."});
  add({.key = "connections_per_identity_max",
       .fallback = whole(core.identity_links_max),
       .range = NumberRange{0, 10000},
       .used_by = UsedBy::kServer,
       .help = "The same for one identity, so that one token cannot take all places. 0: "
               "half of connections_max, but at least 8."});
}

void add_times(Rows& rows, const SideOptions& core) {
  const auto add = section_adder(rows, "Connection");
  add({.key = "dead_after",
       .fallback = seconds(core.dead_after),
       .range = NumberRange{0.2, 300},
       .unit = "s",
       .help = "A peer that was silent for this time counts as gone."});
  add({.key = "resume.seconds",
       .fallback = 60.0,
       .range = NumberRange{0, 3600},
       .unit = "s",
       .help = "How long after a loss the messages of reliable topics are kept for the "
               "peer's return (see \"After a break\"). 0: not at all."});
  add({.key = "resume.bytes",
       .fallback = whole(core.resume_bytes_max),
       .range = NumberRange{0, kGiB},
       .unit = "bytes",
       .help = "How many bytes of them are kept for one peer. Beyond that the topic "
               "with the most bytes loses its oldest message."});
  add({.key = "retry_min",
       .fallback = seconds(core.retry_min),
       .range = NumberRange{0.05, 600},
       .used_by = UsedBy::kClient,
       .unit = "s",
       .help = "First wait before dialing again; it doubles with each failure."});
  add({.key = "retry_max",
       .fallback = seconds(core.retry_max),
       .range = NumberRange{0.05, 600},
       .used_by = UsedBy::kClient,
       .unit = "s",
       .help = "Longest wait before dialing again."});
  add({.key = "dial_timeout",
       .fallback = seconds(core.dial_timeout),
       .range = NumberRange{1, 300},
       .used_by = UsedBy::kClient,
       .unit = "s",
       .help = "Time for name look-up, TCP, TLS and WebSocket together."});
  add({.key = "login_timeout",
       .fallback = seconds(core.login_timeout),
       .range = NumberRange{1, 60},
       .used_by = UsedBy::kServer,
       .unit = "s",
       .help = "Time that a connection has to log in."});
}

void add_flow(Rows& rows, const SideOptions& core) {
  const auto add = section_adder(rows, "Connection");
  add({.key = "link.bytes_per_second",
       .fallback = whole(core.outbox.bytes_per_second_max),
       .range = NumberRange{0, 1e12},
       .unit = "bytes/s",
       .help = "The most that this side sends on one link, for connections that are paid "
               "by the megabyte: bytes of IP packets, as `usage_file` counts them. Urgent "
               "messages count and are never held back. 0: no limit; values below 1000 mean "
               "1000 (see \"A connection that is paid by the megabyte\")."});
  add({.key = "not_sent_bytes",
       .fallback = whole(16384),
       .range = NumberRange{0, 16777216},
       .unit = "bytes",
       .help = "TCP_NOTSENT_LOWAT: bytes that may wait in the kernel, fewer on a slow link. A "
               "small value keeps urgent messages fast; 0 leaves it to the host."});
  add({.key = "queue_delay_target",
       .fallback = seconds(core.outbox.queue_delay_target),
       .range = NumberRange{0, 1},
       .unit = "s",
       .help = "Delay that data which is not urgent may cause in the queues on the path: it "
               "is sent as fast as the link delivers, no faster (docs/flow.md). "
               "0 sends as fast as TCP takes it."});
  add({.key = "congestion_control",
       .fallback = "auto",
       .syntax = check_word,
       .help = "TCP congestion control: `auto` is cubic, and bbr, where the host allows "
               "it, while the network loses packets all the time; "
               "`host` leaves the host's, any other word is the algorithm to use."});
}

}  // namespace

const std::vector<KeySpec>& key_table() {
  static const Rows table = [] {
    const SideOptions core;
    Rows rows;
    add_reach_rows(rows);
    add_login_rows(rows);
    add_tls(rows);
    add_names(rows);
    add_operation(rows);
    add_audit_rows(rows);
    add_times(rows, core);
    add_flow(rows, core);
    add_link_limits(rows, core);
    add_numbers(rows, core);
    add_mirror_limits(rows, core);
    add_share_rows(rows, core);
    add_stranger_rows(rows, core);
    section_adder(rows, "Rules")(
        {.key = "rules",
         .fallback = Strings{},
         .syntax = check_rule_name,
         .changeable = true,
         .help = "Names of the rules in their order: the first that allows an interface "
                 "decides its treatment."});
    add_rule_rows(rows);
    return rows;
  }();
  return table;
}

}  // namespace connect_bridge
