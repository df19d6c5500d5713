#include "config/rule_rows.hpp"

#include <utility>

#include "config/syntax.hpp"
#include "core/policy/treatment.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {
namespace {

using namespace syntax;  // NOLINT: a table reads better without the repeated word
using Strings = std::vector<std::string>;
using Rows = std::vector<KeySpec>;

template <class Words>
Strings texts(const Words& words) {
  Strings list;
  for (const auto& entry : words) list.emplace_back(entry.word);
  return list;
}

// What a rule allows.
void add_rule_rights(Rows& rows) {
  const auto add = section_adder(rows, "Keys of a rule: what it allows");
  const auto patterns = [&](const char* key, const char* help) {
    add({.key = key,
         .fallback = Strings{},
         .syntax = check_pattern,
         .changeable = true,
         .help = help});
  };
  patterns("rule.<name>.export_topics", "Topics that the peer may receive from this side.");
  patterns("rule.<name>.import_topics", "Topics that the peer may publish at this side.");
  patterns("rule.<name>.export_services", "Services of this side that the peer may call.");
  patterns("rule.<name>.import_services", "Services of the peer that exist at this side.");
  patterns("rule.<name>.export_actions", "Actions of this side that the peer may use.");
  patterns("rule.<name>.import_actions", "Actions of the peer that exist at this side.");
  patterns("rule.<name>.export_parameters",
           "Nodes of this side whose parameters the peer may read and set.");
  patterns("rule.<name>.import_parameters",
           "Nodes of the peer whose parameters can be read and set at this side.");
  patterns("rule.<name>.parameters",
           "At a server the same as export_parameters, at a client as import_parameters.");
  patterns("rule.<name>.deny", "Names that no rule allows, whatever else matches.");
  const auto narrow = [&](const char* key, UsedBy used_by, Syntax syntax, const char* help) {
    add({.key = key,
         .fallback = Strings{},
         .syntax = syntax,
         .used_by = used_by,
         .changeable = true,
         .help = help});
  };
  narrow("rule.<name>.types", UsedBy::kBoth, check_type, "Only these types; empty: any.");
  narrow("rule.<name>.identities", UsedBy::kServer, check_not_empty,
         "Only for these identities. With neither identities nor groups: for everyone who is "
         "logged in.");
  narrow("rule.<name>.groups", UsedBy::kServer, check_not_empty,
         "Only for members of these groups (or the identities).");
}

// Of how a rule treats messages; keys are without "rule.<name>.".
auto treatment_adder(Rows& rows) {
  return [add = section_adder(rows, "Keys of a rule: how it treats messages")](KeySpec spec) {
    spec.key = "rule.<name>." + spec.key;
    add(std::move(spec));
  };
}

// How a rule treats what it allows.
void add_rule_treatment(Rows& rows) {
  const auto add = treatment_adder(rows);
  add({.key = "priority",
       .words = texts(kPriorityWords),
       .changeable = true,
       .help = "Urgent goes before everything; the others share 8 : 4 : 1. Unset: by name and type "
               "(/clock, Twist and Joy urgent; services, /tf and joint states high; images, clouds "
               "and maps bulk), and small messages go right behind the urgent ones."});
  add({.key = "compression",
       .fallback = "auto",
       .syntax = check_compression,
       .changeable = true,
       .help = "`auto` (where messages arrive sooner, by the link's rate and by how much they "
               "shrink; not what is urgent), `none`, `lz4`, `zstd` or `zstd:<level>` (1 to 19; "
               "`zstd` is level 3)."});
  add({.key = "max_rate",
       .type = ParameterType::kDouble,
       .range = NumberRange{0.001, 1e6},
       .changeable = true,
       .unit = "Hz",
       .help =
           "Messages per second of one topic: what is sent, and what is taken from each peer, its "
           "last samples of a transient-local topic included; unset: all."});
  add({.key = "max_bytes_per_second",
       .type = ParameterType::kInteger,
       .range = NumberRange{1, 1e12},
       .changeable = true,
       .unit = "bytes/s",
       .help = "Bandwidth of one topic, uncompressed, sent or taken as for max_rate; unset: no "
               "limit."});
  add({.key = "max_age",
       .type = ParameterType::kDouble,
       .range = NumberRange{0.001, 86400},
       .changeable = true,
       .unit = "s",
       .help = "Older messages are dropped rather than delivered late; unset: never."});
  add({.key = "queue_bytes_max",
       .type = ParameterType::kInteger,
       .range = NumberRange{1024, kGiB},
       .changeable = true,
       .unit = "bytes",
       .help =
           "What may wait to be sent of one topic; one message always fits. Of a transient-local "
           "topic "
           "at least history_bytes_max may. Unset: a quarter of the link's queue_bytes_max, but "
           "1 MiB while the oldest waits for more than 0.25 s: the link is too slow then."});
  add({.key = "clock",
       .fallback = "relay",
       .words = {"relay", "publish"},
       .used_by = UsedBy::kClient,
       .help = "For a rule that imports /clock. `publish`: this side publishes the peer's ROS time "
               "itself, evenly at clock_rate, however the link behaves."});
  add({.key = "clock_rate",
       .fallback = 50.0,
       .range = NumberRange{1, 1000},
       .used_by = UsedBy::kClient,
       .unit = "Hz",
       .help = "How often `clock: publish` publishes."});
}

// What happens to it when a connection is lost.
void add_rule_resume(Rows& rows) {
  treatment_adder(rows)(
      {.key = "resume",
       .type = ParameterType::kBool,
       .changeable = true,
       .help = "Whether messages of reliable volatile topics that a lost connection loses are sent "
               "again (see \"After a break\"). Unset: yes, except for what is urgent (also by its "
               "type) or has a max_age."});
}

// What is of another version of its package here.
void add_rule_types(Rows& rows) {
  treatment_adder(rows)(
      {.key = "allow_type_mismatch",
       .fallback = false,
       .changeable = true,
       .help = "Whether what is imported is used although the definition of its type here is not "
               "the peer's (another type hash). Messages that do not fit the one here are dropped, "
               "the others may mean something else. Otherwise it is declined, and the "
               "log says how the definitions differ."});
}

// The same for calls of services.
void add_rule_calls(Rows& rows) {
  const Treatment normal;
  const auto add = treatment_adder(rows);
  add({.key = "calls_max",
       .fallback = static_cast<std::int64_t>(normal.calls_max),
       .range = NumberRange{1, 1000},
       .changeable = true,
       .unit = "calls",
       .help = "Calls of one service under way at its server for one peer; later ones wait for "
               "their turn."});
  add({.key = "server_queue",
       .fallback = static_cast<std::int64_t>(normal.server_queue),
       .range = NumberRange{0, 1000},
       .changeable = true,
       .unit = "requests",
       .help = "Depth of the server's request queue: at most so many requests are handed over that "
               "it may not have taken yet; 0: every request is handed over at once."});
  add({.key = "call_timeout",
       .type = ParameterType::kDouble,
       .range = NumberRange{0.01, 86400},
       .changeable = true,
       .unit = "s",
       .help = "A call without an answer is given up after this; unset: never."});
}

void add_rule_qos(Rows& rows) {
  const auto add_row = section_adder(rows, "Keys of a rule: QoS in place of the origin's");
  const auto add = [&](KeySpec spec) {
    spec.key = "rule.<name>.qos." + spec.key;
    spec.changeable = true;
    add_row(std::move(spec));
  };
  add({.key = "reliability", .words = texts(kReliabilityWords), .help = "Reliability."});
  add({.key = "durability", .words = texts(kDurabilityWords), .help = "Durability."});
  add({.key = "depth",
       .type = ParameterType::kInteger,
       .range = NumberRange{1, 100000},
       .unit = "messages",
       .help = "Keep-last depth, of the queue too."});
  add({.key = "deadline",
       .type = ParameterType::kDouble,
       .range = NumberRange{0.001, 86400},
       .unit = "s",
       .help = "Longest time between two messages."});
  add({.key = "lifespan",
       .type = ParameterType::kDouble,
       .range = NumberRange{0.001, 86400},
       .unit = "s",
       .help = "Messages older than this are not delivered."});
}

}  // namespace

void add_rule_rows(std::vector<KeySpec>& rows) {
  add_rule_rights(rows);
  add_rule_treatment(rows);
  add_rule_resume(rows);
  add_rule_types(rows);
  add_rule_calls(rows);
  add_rule_qos(rows);
}

}  // namespace connect_bridge
