#include "config/rule_rows.hpp"

#include "config/key_rows.hpp"

namespace connect_bridge {
namespace {

constexpr char kTreats[] = "Keys of a rule: how it treats messages";

using namespace syntax;  // NOLINT: a table reads better without the repeated word

// Adds rows whose keys are given without "rule.<name>.".
auto rule_row_adder(Rows& rows, const char* section) {
  return RowAdder(rows, section, [](KeySpec& spec) {
    spec.key = "rule.<name>." + spec.key;
    spec.changeable = true;
  });
}

template <Direction kDirection, OpenedBy kKind>
void add_opening(const auto& add, const char* help) {
  add({.key = right_key(kDirection, kKind), .syntax = check_pattern, .help = help},
      [](Rule& r) { return &r.opens[kDirection][kKind]; });
}

// The rights that a rule gives.
void add_rule_rights(Rows& rows) {
  const auto add = rule_row_adder(rows, kRuleRights);
  add_opening<Direction::kExport, OpenedBy::kTopics>(
      add, "Topics that the peer may receive from this side.");
  add_opening<Direction::kImport, OpenedBy::kTopics>(
      add, "Topics that the peer may publish at this side.");
  add_opening<Direction::kExport, OpenedBy::kServices>(
      add, "Services of this side that the peer may call.");
  add_opening<Direction::kImport, OpenedBy::kServices>(
      add, "Services of the peer that appear at this side.");
  add_opening<Direction::kExport, OpenedBy::kActions>(
      add, "Actions of this side that the peer may use.");
  add_opening<Direction::kImport, OpenedBy::kActions>(
      add, "Actions of the peer that appear at this side.");
  add_opening<Direction::kExport, OpenedBy::kParameters>(
      add, "Nodes of this side whose parameters the peer may read and set.");
  add_opening<Direction::kImport, OpenedBy::kParameters>(
      add, "Nodes of the peer whose parameters can be read and set at this side.");
  add({.key = "parameters",
       .fallback = Strings{},
       .syntax = check_pattern,
       .help = "At the robot (`robot`) the same as export_parameters, at the other end the same as "
               "import_parameters."});
  add({.key = "deny",
       .syntax = check_pattern,
       .help = "Names that no rule allows, whatever other patterns match."},
      [](Rule& r) { return &r.deny; });
  const auto narrow = [&](const char* key, Syntax syntax, const char* help, auto field) {
    add({.key = key, .syntax = syntax, .help = help}, field);
  };
  narrow("types", check_type, "Only these types. Empty: any type.",
         [](Rule& r) { return &r.types; });
  narrow("identities", check_not_empty,
         "Only for these identities: clients by their login, a server by its key (`tls.pin`) or "
         "certificate. With neither identities nor groups: for everyone who is logged in.",
         [](Rule& r) { return &r.identities; });
  narrow("groups", check_not_empty, "Only for members of these groups (or the identities).",
         [](Rule& r) { return &r.groups; });
}

// The treatment of messages that a rule allows.
void add_rule_treatment(Rows& rows) {
  const auto add = rule_row_adder(rows, kTreats);
  add({.key = "priority",
       .help = "Urgent goes before everything; the others share the link 8 : 4 : 1. Unset: by type "
               "(docs/flow.md section 4)."},
      [](Rule& r) { return &r.treatment.priority; });
  add({.key = "compression",
       .fallback = "auto",
       .syntax = check_compression,
       .help = "`auto` (where messages arrive sooner; never for urgent ones), `none`, `lz4`, "
               "`zstd` or `zstd:<level>` (1 to 19; `zstd` is level 3)."},
      [](Rule& r) { return &r.treatment.compression; });
  add({.key = "lossy",
       .help = "`never`: every message arrives bit for bit. `auto`: where the link would carry "
               "fewer than five exact ones a second, and fewer than half of those published, "
               "points of a cloud are rounded, and an Image or a JPEG is sent as video. `never` "
               "at either end forbids it. Unset: `auto`, but a picture only if its node also "
               "publishes `camera_info` beside it."},
      [](Rule& r) { return &r.treatment.lossy; });
  add("max_error", {0.0001, 1}, "m",
      "How far a point may move where `lossy` allows it. The bridge rounds to the finest of 1, 2, "
      "5 and 10 mm that fits, never to more than twice this.",
      [](Rule& r) { return &r.treatment.max_error; });
  add("grid", {0.001, 100}, "m",
      "Of a cloud, only the first point in each cell of this size is sent, where `lossy` allows "
      "it. Unset: all points.",
      [](Rule& r) { return &r.treatment.grid; });
  add({.key = "keep",
       .help = "Which messages wait when a link carries less than is published. `newest`: the "
               "newest message of each publisher. `all`: all messages, for at most 5 s. Unset: by "
               "type; the status shows the choice and its reason."},
      [](Rule& r) { return &r.treatment.keep; });
  add({.key = "with_large",
       .help = "`true`: a message leaves with the large one (image, cloud, map) of the same stamp, "
               "node and namespace, and is dropped with it. Both types must begin with a Header. "
               "No effect on urgent and high messages. Unset: CameraInfo only."},
      [](Rule& r) { return &r.treatment.with_large; });
  add("max_rate", {0.001, 1e6}, "Hz",
      "Messages per second of one publisher, sent or received: of each state that its messages "
      "tell (frames of a TFMessage, joints of a JointState, parts of a DiagnosticArray). The "
      "newest message is late rather than dropped. Of a video, what is too much is dropped up to "
      "the next key frame. Unset: no limit.",
      [](Rule& r) { return &r.treatment.max_rate; });
  add("max_bytes_per_second", {1, 1e12}, "bytes/s", "The same limit in bytes, uncompressed.",
      [](Rule& r) { return &r.treatment.bytes_per_second_max; });
  add("max_age", {0.001, 86400}, "s",
      "Older messages are dropped, also those of transient-local topics. Unset: never.",
      [](Rule& r) { return &r.treatment.max_age; });
  add("queue_bytes_max", {1024, kGiB}, "bytes",
      "Bytes of one topic that may wait to be sent; at least 64 MiB for a transient-local topic. "
      "Unset: 16 MiB, but 1 MiB while the oldest waits for more than 0.25 s.",
      [](Rule& r) { return &r.treatment.queue_bytes_max; });
}

// The key that is fixed at start.
void add_rule_clock(Rows& rows) {
  const auto add = row_adder(rows, kTreats);
  add({.key = "rule.<name>.clock",
       .fallback = "relay",
       .words = {"relay", "publish"},
       .help = "For a rule that imports /clock. `publish`: this side publishes the peer's ROS time "
               "itself, evenly, 100 times a second. With several peers it uses the time of one."});
}

// The treatment after a break, and with another version of the type's package here.
void add_rule_exceptions(Rows& rows) {
  const auto add = rule_row_adder(rows, kTreats);
  add({.key = "resume",
       .help = "Whether messages of reliable volatile topics that a lost connection loses are sent "
               "again (see \"After a break\")."},
      [](Rule& r) { return &r.treatment.resume; });
  add({.key = "drives",
       .help = "Whether the interface moves the robot. Messages published before the connection, "
               "or before somebody subscribed, are then never forwarded. Unset: by type and name "
               "(see \"After a break\")."},
      [](Rule& r) { return &r.treatment.drives; });
  add({.key = "allow_type_mismatch",
       .fallback = false,
       .help = "Whether to use imports whose type has another definition here than at the peer. "
               "Messages that fit the definition here may then mean something else."},
      [](Rule& r) { return &r.treatment.allow_type_mismatch; });
}

// The driver of a topic, at the side that is the robot.
void add_rule_driving(Rows& rows) {
  const auto add = rule_row_adder(rows, kTreats);
  add({.key = "wheel",
       .fallback = true,
       .help = "At the robot, for Twist, TwistStamped, AckermannDrive and AckermannDriveStamped: "
               "one peer steers a topic at a time (docs/driving.md)."},
      [](Rule& r) { return &r.treatment.wheel; });
  add("halt_after", {0.05, 10}, "s",
      "The same topics: when the peer that steers has been silent for this time, and its last "
      "command moved, the robot's side publishes a zero. Unset: never.",
      [](Rule& r) { return &r.treatment.halt_after; });
  add({.key = "let_go",
       .fallback = true,
       .help = "The same topics: a peer that was halted says neutral, or begins a command again, "
               "before it moves the robot. `false`: for a controller that never says neutral."},
      [](Rule& r) { return &r.treatment.let_go; });
}

// The treatment of calls of services.
void add_rule_calls(Rows& rows) {
  const auto add = rule_row_adder(rows, kTreats);
  add("calls_max", {1, 1000}, "calls",
      "Calls of one service in progress for one identity, whose links have one each at least. "
      "Later "
      "calls wait for their turn.",
      [](Rule& r) { return &r.treatment.calls_max; });
  add("server_queue", {0, 1000}, "requests",
      "Depth of the server's request queue. The bridge delivers at most this many requests that "
      "the server may not have taken yet. 0: no limit.",
      [](Rule& r) { return &r.treatment.server_queue; });
  add("call_timeout", {0.01, 86400}, "s",
      "The bridge abandons a call without an answer after this time. Unset: never.",
      [](Rule& r) { return &r.treatment.call_timeout; });
  add("cancel_after", {0.1, 86400}, "s",
      "Actions of this side: when a link has been lost for this time, its goals that have not "
      "ended "
      "are cancelled. Unset: they go on.",
      [](Rule& r) { return &r.treatment.cancel_after; });
}

void add_rule_qos(Rows& rows) {
  const auto add = rule_row_adder(rows, "Keys of a rule: QoS in place of the origin's");
  add({.key = "qos.reliability", .help = "Reliability."},
      [](Rule& r) { return &r.treatment.qos.reliability; });
  add({.key = "qos.durability",
       .help = "Durability. The exporting side accepts only a weaker one than the publisher has. "
               "Its subscription serves all links: volatile for one is volatile for all."},
      [](Rule& r) { return &r.treatment.qos.durability; });
  add("qos.depth", {1, 100000}, "messages", "Keep-last depth, also of the queue.",
      [](Rule& r) { return &r.treatment.qos.depth; });
}

}  // namespace

void add_rule_rows(std::vector<KeySpec>& rows) {
  row_adder(rows, "Rules")({.key = "rules",
                            .fallback = Strings{},
                            .syntax = check_rule_name,
                            .changeable = true,
                            .help = "Names of the rules in their order. The first rule that allows "
                                    "an interface decides its treatment."});
  add_rule_rights(rows);
  add_rule_treatment(rows);
  add_rule_clock(rows);
  add_rule_exceptions(rows);
  add_rule_driving(rows);
  add_rule_calls(rows);
  add_rule_qos(rows);
}

std::string right_key(Direction direction, OpenedBy kind) {
  const std::string word = direction == Direction::kExport ? "export_" : "import_";
  switch (kind) {
    case OpenedBy::kNothing: break;
    case OpenedBy::kTopics: return word + "topics";
    case OpenedBy::kServices: return word + "services";
    case OpenedBy::kActions: return word + "actions";
    case OpenedBy::kParameters: return word + "parameters";
  }
  return {};
}

}  // namespace connect_bridge
