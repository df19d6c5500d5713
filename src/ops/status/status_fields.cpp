#include "ops/status/status_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "core/policy/treatment.hpp"
#include "ops/audit/audit_json.hpp"
#include "ops/status/peer_findings.hpp"
#include "ops/status/status_json.hpp"

namespace connect_bridge {
namespace {

using As = Column::As;
using In = Column::In;

// The value of a member.
template <auto member, class Of>
OrderedJson get(const Of& of) {
  return of.*member;
}

// Left out while it is empty.
template <auto member, class Of>
OrderedJson if_any(const Of& of) {
  return (of.*member).empty() ? OrderedJson() : OrderedJson(of.*member);
}

// Left out while it is false.
template <auto member, class Of>
OrderedJson if_set(const Of& of) {
  return of.*member ? OrderedJson(true) : OrderedJson();
}

template <class Of>
OrderedJson direction(const Of& of) {
  return of.exported ? "export" : "import";
}

template <class Of>
OrderedJson state(const Of& of) {
  return name_of(state_of(of));
}

OrderedJson time_of(Stamp time) {
  if (time == 0) return {};
  return rfc3339(std::chrono::system_clock::time_point(
      std::chrono::duration_cast<std::chrono::system_clock::duration>(Duration(time))));
}

constexpr Series counter(std::string_view name, std::string_view help,
                         std::string_view label = {}) {
  return {Series::Kind::kCounter, name, help, label};
}
constexpr Series gauge(std::string_view name, std::string_view help) {
  return {Series::Kind::kGauge, name, help, {}};
}
constexpr Series most(std::string_view name, std::string_view help) {
  return {Series::Kind::kMost, name, help, {}};
}

// ---- the side

template <auto member>
OrderedJson of_run(const StatusPicture& side) {
  return side.run.*member;
}
template <auto member>
OrderedJson of_ros(const StatusPicture& side) {
  return side.run.ros.*member;
}
template <auto member>
OrderedJson of_network(const StatusPicture& side) {
  return side.run.network.*member;
}
template <auto member>
OrderedJson of_core(const StatusPicture& side) {
  return side.side.*member;
}
// Nothing at a client.
template <auto member>
OrderedJson at_door(const StatusPicture& side) {
  return side.run.role == Role::kServer ? of_network<member>(side) : OrderedJson();
}
template <auto member>
OrderedJson of_strangers(const StatusPicture& side) {
  return side.run.role == Role::kServer ? OrderedJson(side.side.strangers.*member) : OrderedJson();
}

OrderedJson relays(const StatusPicture& side) {
  if (side.run.relays.empty()) return {};
  OrderedJson all = OrderedJson::array();
  for (const PlaceAtRelay& place : side.run.relays) {
    OrderedJson one = {{"relay", place.relay}, {"connected", place.connected_since != 0}};
    if (place.connected_since != 0) one["connected_since"] = time_of(place.connected_since);
    if (place.failure.cause != Cause::kNone) {
      one["last_failure"] = place.failure.text;
      one["last_failure_code"] = word_of(place.failure.cause);
    }
    all.push_back(std::move(one));
  }
  return all;
}

OrderedJson refused_files(const StatusPicture& side) {
  OrderedJson all;
  for (const std::string& why : side.run.refused_files) all.push_back({{"reason", why}});
  return all;
}

template <auto member>
OrderedJson lately(const StatusPicture& side) {
  return side.run.lately ? OrderedJson((*side.run.lately).*member) : OrderedJson();
}

constexpr StatusField<StatusPicture> kSideFields[] = {
    {"schema", Unit::kNone, [](const StatusPicture&) { return OrderedJson(kStatusSchema); },
     "1; another number says that a member has gone or means something else"},
    {"time", Unit::kNone, of_run<&RunStatus::time>, "the moment of this status"},
    {"running", Unit::kNone, of_run<&RunStatus::running>, "false: the program has ended"},
    {"started", Unit::kNone, of_run<&RunStatus::started>, "when the program started"},
    {"version", Unit::kNone, of_run<&RunStatus::version>, "of the program"},
    {"node", Unit::kNone, of_run<&RunStatus::node>, "name of its node"},
    {"role", Unit::kNone,
     [](const StatusPicture& s) {
       return OrderedJson(s.run.role == Role::kServer ? "server" : "client");
     },
     "`server` or `client`"},
    {"is_robot", Unit::kNone, of_run<&RunStatus::is_robot>,
     "whether this end is the robot, by its key `robot`"},
    {"prefix", Unit::kNone,
     [](const StatusPicture& s) {
       return s.run.prefix.empty() ? OrderedJson() : OrderedJson(s.run.prefix);
     },
     "the key `prefix`: rules have the names without it"},
    {"loop_lag_ms", Unit::kMilliseconds, of_run<&RunStatus::loop_lag_ms>,
     "longest delay of the loop in the last second",
     gauge("loop_lag_seconds", "Longest delay of the loop in the last second")},
    {"memory_bytes", Unit::kBytes, of_core<&Status::memory_bytes>, "queues, histories, reassembly"},
    {"memory_max_used_bytes", Unit::kBytes, of_core<&Status::shared_bytes>,
     "memory that all peers use, of `memory_max`",
     gauge("memory_bytes", "Memory that peers use, of memory_max")},
    {"memory_max_bytes", Unit::kBytes, of_core<&Status::shared_bytes_max>, "`memory_max`",
     gauge("memory_max_bytes", "memory_max")},
    {"made_unanswered", Unit::kNone, of_core<&Status::made_unanswered>,
     "calls of local callers that ended without an answer, on all links",
     counter("made_unanswered", "Calls of local callers that ended without an answer")},
    {"served_unanswered", Unit::kNone, of_core<&Status::served_unanswered>,
     "calls of peers that ended without an answer, on all links",
     counter("served_unanswered", "Calls of peers that ended without an answer")},
    {"taken", Unit::kNone, of_ros<&ros::GatewayCounters::taken>,
     "messages taken from the local graph",
     counter("taken", "Messages taken from the local graph")},
    {"published", Unit::kNone, of_ros<&ros::GatewayCounters::published>,
     "messages published in the local graph",
     counter("published", "Messages published in the local graph")},
    {"traffic.sent_bytes", Unit::kBytes,
     [](const StatusPicture& s) { return OrderedJson(s.run.traffic.sent); },
     "since the start, as a provider counts: IP packets with headers, TLS and retransmissions, "
     "also "
     "of unauthenticated connections, of failed dials and of the relay's control connection",
     counter("sent_bytes", "Bytes of IP packets sent")},
    {"traffic.received_bytes", Unit::kBytes,
     [](const StatusPicture& s) { return OrderedJson(s.run.traffic.received); },
     "the same, received", counter("received_bytes", "Bytes of IP packets received")},
    {"types_not_installed", Unit::kNone, of_ros<&ros::GatewayCounters::types_not_installed>,
     "types that are carried without their package"},
    {"reading_held", Unit::kNone, of_network<&NetworkCounts::held>,
     "times that reading waited since a peer sent more than it may",
     counter("reading_held", "Times that reading waited since a peer sent more than it may")},
    {"extra_frames", Unit::kNone, of_network<&NetworkCounts::extra_frames>,
     "WebSocket frames beyond one for each message"},
    {"last_failure",
     Unit::kNone,
     [](const StatusPicture& s) { return OrderedJson(s.side.last_failure.text); },
     "why the last connection closed, for people",
     {},
     {},
     SeenBy::kUserOfServer},
    {"last_failure_code", Unit::kNone,
     [](const StatusPicture& s) { return OrderedJson(word_of(s.side.last_failure.cause)); },
     "the same as a word of [the causes](#causes); empty while a link is open"},
    {"listens", Unit::kNone,
     [](const StatusPicture& s) {
       return s.run.listens.empty() ? OrderedJson() : OrderedJson(s.run.listens);
     },
     "server: the addresses at which it listens"},
    {"certificate_valid_until", Unit::kNone,
     [](const StatusPicture& s) { return time_of(s.run.certificate_end); },
     "of the certificate in use"},
    {"audit.lines", Unit::kNone,
     [](const StatusPicture& s) {
       return s.run.audit ? OrderedJson(s.run.audit->lines) : OrderedJson();
     },
     "lines written to the audit log", counter("audit_lines", "Lines written to the audit log")},
    {"audit.left_out", Unit::kNone,
     [](const StatusPicture& s) {
       return s.run.audit ? OrderedJson(s.run.audit->left_out) : OrderedJson();
     },
     "lines that were not", counter("audit_left_out", "Lines that were not")},
    {"audit.problem", Unit::kNone,
     [](const StatusPicture& s) {
       return s.run.audit && !s.run.audit->problem.empty() ? OrderedJson(s.run.audit->problem)
                                                           : OrderedJson();
     },
     "why the audit log cannot be written"},
    {"refused_parameters.time", Unit::kNone,
     [](const StatusPicture& s) {
       return s.run.refused_parameters ? OrderedJson(s.run.refused_parameters->time)
                                       : OrderedJson();
     },
     "when a changed parameter file was refused; the parameters before it stay in use"},
    {"refused_parameters.problem",
     Unit::kNone,
     [](const StatusPicture& s) {
       return s.run.refused_parameters ? OrderedJson(s.run.refused_parameters->problem)
                                       : OrderedJson();
     },
     "what is wrong with it",
     {},
     {},
     SeenBy::kUser},
    {"refused_files",
     Unit::kNone,
     refused_files,
     "files of tokens or TLS that were changed and cannot be used, each with its `reason` (for "
     "this "
     "user only); what was read before stays in use",
     {},
     {},
     SeenBy::kUser},
    {"status_file_problem",
     Unit::kNone,
     [](const StatusPicture& s) {
       return s.run.status_file_problem.empty() ? OrderedJson()
                                                : OrderedJson(s.run.status_file_problem);
     },
     "why `status_file` cannot be written",
     {},
     {},
     SeenBy::kUser},
    {"needs_restart", Unit::kNone,
     [](const StatusPicture& s) {
       return s.run.needs_restart.empty() ? OrderedJson() : OrderedJson(s.run.needs_restart);
     },
     "keys that were changed in the parameter file, and that a restart applies"},
    {"lately.loop_lag_ms", Unit::kMilliseconds, lately<&SideLately::loop_lag_ms>,
     "the most of the last 5 to 10 minutes"},
    {"lately.held_up", Unit::kSeconds, lately<&SideLately::held_up>,
     "seconds of this time in which the loop was late by 0.5 s or more"},
    {"lately.refused", Unit::kNone, lately<&SideLately::refused>,
     "connections that were refused before a login in this time"},
    {"lately.wrong_logins", Unit::kNone, lately<&SideLately::wrong_logins>,
     "wrong logins in this time"},
    {"lately.logins_not_judged", Unit::kNone, lately<&SideLately::logins_not_judged>,
     "logins in this time that the login method could not judge"},
    {"lately.memory_max_used_bytes", Unit::kBytes, lately<&SideLately::shared_bytes>,
     "the most in this time"},
    {"relays", Unit::kNone, relays,
     "server behind a relay: `relay`, `connected`, `connected_since`, `last_failure`, "
     "`last_failure_code`"},
    {"strangers.accepted", Unit::kNone, at_door<&NetworkCounts::accepted>,
     "server: [connections without a login](#unauthenticated-connections)"},
    {"strangers.refused", Unit::kNone, at_door<&NetworkCounts::refused>, "refused before a login",
     counter("connections_refused", "Connections refused before a login")},
    {"strangers.last_refused",
     Unit::kNone,
     [](const StatusPicture& s) {
       const std::string& last = s.run.network.last_refused;
       return last.empty() ? OrderedJson() : OrderedJson(last);
     },
     "the last of these, and why, for people",
     {},
     {},
     SeenBy::kUserOfServer},
    {"strangers.proxy_headers", Unit::kNone, at_door<&NetworkCounts::proxy_headers>,
     "of these: they began with a header of the PROXY protocol, which this server does not expect "
     "of them"},
    {"strangers.waiting", Unit::kNone, of_strangers<&StrangersStatus::waiting>, "now"},
    {"strangers.gave_way", Unit::kNone,
     [](const StatusPicture& s) {
       return s.run.role == Role::kServer
                  ? OrderedJson(s.run.network.gave_way + s.side.strangers.gave_way)
                  : OrderedJson();
     },
     "closed for newer connections"},
    {"strangers.handshakes_waited", Unit::kNone, at_door<&NetworkCounts::handshakes_waited>,
     "handshakes that waited for a place"},
    {"strangers.handshakes_dropped", Unit::kNone, at_door<&NetworkCounts::handshakes_dropped>,
     "handshakes that got none"},
    {"strangers.wrong_logins", Unit::kNone, of_strangers<&StrangersStatus::wrong_logins>,
     "wrong or expired logins", counter("wrong_logins", "Wrong logins")},
    {"strangers.last_wrong_login",
     Unit::kNone,
     [](const StatusPicture& side) {
       const std::string& why = side.side.strangers.last_wrong_login;
       return why.empty() ? OrderedJson() : OrderedJson(why);
     },
     "why the last of them was wrong",
     {},
     {},
     SeenBy::kUser},
    {"strangers.wrong_logins_late", Unit::kNone, of_strangers<&StrangersStatus::wrong_logins_late>,
     "of these: answered late, since there were too many"},
    {"strangers.shut_out", Unit::kNone, of_strangers<&StrangersStatus::shut_out>,
     "right logins put off, since links of the identity had offended"},
    {"strangers.login_timeouts", Unit::kNone, of_strangers<&StrangersStatus::login_timeouts>,
     "no login in time", counter("login_timeouts", "Connections without a login in time")},
    {"strangers.logins_without_place", Unit::kNone,
     of_strangers<&StrangersStatus::logins_without_place>,
     "right logins refused at `connections_max`"},
    {"strangers.logins_not_judged", Unit::kNone, of_strangers<&StrangersStatus::logins_not_judged>,
     "the login method did not answer as it should"},
};

// ---- links

template <auto member>
OrderedJson of_clock(const LinkStatus& link) {
  return link.clock.known ? OrderedJson(milliseconds_of(link.clock.*member)) : OrderedJson();
}

template <auto member>
OrderedJson of_lately(const LinkStatus& link) {
  return link.lately ? OrderedJson((*link.lately).*member) : OrderedJson();
}

// As the operator of the link is told.
OrderedJson wheel_word(const std::optional<WheelState>& wheel) {
  return wheel ? OrderedJson(word_of(kWheelStateWords, *wheel)) : OrderedJson();
}

OrderedJson breaks(const LinkStatus& link) {
  if (link.breaks.empty()) return {};
  OrderedJson all = OrderedJson::array();
  for (const LinkBreak& one : link.breaks) {
    OrderedJson shown = {{"lost", time_of(one.lost)},
                         {"reason", one.why.text},
                         {"code", word_of(one.why.cause)},
                         {"by_peer", one.by_peer}};
    if (one.back != 0) {
      shown["back"] = time_of(one.back);
      shown["seconds"] = static_cast<double>(one.back - one.lost) / kStampSecond;
    }
    all.push_back(std::move(shown));
  }
  return all;
}

OrderedJson peer_findings(const LinkStatus& link) {
  OrderedJson all;
  for (const PeerFinding& one : link.peer_findings)
    if (is_for_peers(one.id)) all.push_back({{"id", one.id}, {"name", one.name}});
  return all;
}

constexpr StatusField<LinkStatus> kLinkFields[] = {
    {"link", Unit::kNone, get<&LinkStatus::number>, "number of the link"},
    {"peer", Unit::kNone, get<&LinkStatus::peer>, "address of the peer"},
    {"node", Unit::kNone, get<&LinkStatus::node>, "name of its node"},
    {"identity",
     Unit::kNone,
     get<&LinkStatus::identity>,
     "who it logged in as",
     {},
     {},
     SeenBy::kUser},
    {"state", Unit::kNone, state<LinkStatus>, "`open` or `lost`"},
    {"open", Unit::kNone, get<&LinkStatus::open>, "the same as a boolean",
     gauge("link_open", "Whether a link is connected")},
    {"open_seconds", Unit::kSeconds,
     [](const LinkStatus& l) {
       return OrderedJson(std::chrono::floor<std::chrono::seconds>(l.open_for).count());
     },
     "since the link was connected"},
    {"unheard_seconds", Unit::kSeconds,
     [](const LinkStatus& l) {
       return OrderedJson(std::chrono::floor<std::chrono::seconds>(l.unheard).count());
     },
     "since the last packet of the peer, while the link is open"},
    {"connects", Unit::kNone, get<&LinkStatus::connects>, "times that the link was connected",
     counter("link_connects", "Times that the link was connected")},
    {"breaks",
     Unit::kNone,
     breaks,
     "the last 8 breaks: `lost`, `reason` (for this user only), its `code` of [the "
     "causes](#causes), whether the connection was closed `by_peer`, and once it is over `back` "
     "and `seconds`",
     {},
     {},
     SeenBy::kUser},
    {"peer_findings", Unit::kNone, peer_findings,
     "what does not work at the other end and concerns this link: `id` of "
     "[a finding](findings.md), `name` of its topic or service"},
    {"same_graph", Unit::kNone, if_set<&LinkStatus::same_graph>,
     "true: both ends are in one ROS graph"},
    {"two_of_a_kind", Unit::kNone, if_set<&LinkStatus::two_of_a_kind>,
     "true: by the key `robot` both ends are the robot, or none is"},
    {"mirrors_waited", Unit::kNone, get<&LinkStatus::mirrors_waited>,
     "publishers, services and subscriptions that waited for a place"},
    {"sent_bytes", Unit::kBytes, get<&LinkStatus::sent_bytes>, "sent on this connection",
     counter("link_sent_bytes", "Bytes sent on the connection of a link")},
    {"received_bytes", Unit::kBytes, get<&LinkStatus::received_bytes>, "received on it",
     counter("link_received_bytes", "Bytes received on it")},
    {"segments", Unit::kNone, get<&LinkStatus::segments>, "TCP segments with data sent on it",
     counter("link_segments", "TCP segments with data sent on the connection of a link")},
    {"retransmitted", Unit::kNone, get<&LinkStatus::retransmitted>,
     "of these: sent again after a loss",
     counter("link_retransmitted", "TCP segments that were sent again")},
    {"queued_bytes", Unit::kBytes, get<&LinkStatus::queued_bytes>, "wait to be sent",
     gauge("link_queued_bytes", "Bytes that wait to be sent")},
    {"unacknowledged_bytes", Unit::kBytes, get<&LinkStatus::unacknowledged_bytes>,
     "sent and not yet acknowledged",
     gauge("link_unacknowledged_bytes", "Bytes that were sent and not yet acknowledged")},
    {"memory_bytes", Unit::kBytes, get<&LinkStatus::memory_bytes>,
     "memory held because of the peer",
     gauge("link_memory_bytes", "Memory that is held because of the peer")},
    {"rate_bytes_per_second", Unit::kBytesPerSecond,
     [](const LinkStatus& l) { return OrderedJson(static_cast<std::uint64_t>(l.rate)); },
     "estimated bandwidth of the path; 0: not known",
     gauge("link_rate_bytes_per_second", "Estimated bandwidth of the path")},
    {"path_queue_ms", Unit::kMilliseconds,
     [](const LinkStatus& l) { return OrderedJson(milliseconds_of(l.path_queue)); },
     "queueing delay on the path", gauge("link_path_queue_seconds", "Queueing delay on the path")},
    {"clock.offset_ms", Unit::kMilliseconds, of_clock<&ClockStatus::offset>,
     "the peer's system clock minus this one"},
    {"clock.round_trip_ms", Unit::kMilliseconds, of_clock<&ClockStatus::round_trip>,
     "round trip of the path, without its queue",
     gauge("link_round_trip_seconds", "Round trip of the path, without its queue")},
    {"clock.error_bound_ms", Unit::kMilliseconds, of_clock<&ClockStatus::error_bound>,
     "how far off the offset may be"},
    {"lately.path_queue_ms", Unit::kMilliseconds,
     [](const LinkStatus& l) {
       return l.lately ? OrderedJson(milliseconds_of(l.lately->path_queue)) : OrderedJson();
     },
     "what it reached at three looks at least, 10 s apart, of the last 5 to 10 minutes"},
    {"lately.segments", Unit::kNone, of_lately<&LinkStatus::Lately::segments>,
     "TCP segments sent in this time"},
    {"lately.retransmitted", Unit::kNone, of_lately<&LinkStatus::Lately::retransmitted>,
     "of these: sent again"},
    {"wheel", Unit::kNone, [](const LinkStatus& l) { return wheel_word(l.wheel()); },
     "who steers the robot: [the words](driving.md#who-sees-it)"},
    {"drives", Unit::kNone,
     [](const LinkStatus& l) {
       return l.wheel() ? OrderedJson(l.wheel() == WheelState::kYours) : OrderedJson();
     },
     "at the robot: the peer steers; at the operator: this side does",
     gauge("link_drives", "Whether the operator of a link steers the robot")},
    {"login_valid_until", Unit::kNone, [](const LinkStatus& l) { return time_of(l.login_end); },
     "server: when the login expires"},
};

// ---- topics

OrderedJson shown(const DropCounts& dropped) {
  OrderedJson counts = OrderedJson::object();
  for (std::size_t i = 0; i < kDropReasons; ++i)
    if (dropped.by_reason[i] > 0)
      counts[std::string(name_of(static_cast<DropReason>(i)))] = dropped.by_reason[i];
  return counts;
}

OrderedJson dropped(const TopicStatus& topic) {
  return shown(topic.dropped);
}

OrderedJson lately_of(const TopicStatus& topic) {
  if (!topic.lately) return {};
  return {{"messages", topic.lately->messages},
          {"wire_bytes", topic.lately->wire_bytes},
          {"dropped", shown(topic.lately->dropped)}};
}

OrderedJson sent_as(const TopicStatus& topic) {
  switch (topic.sent_as.codec) {
    case Codec::kPlanes: return "planes";
    case Codec::kCloud: return "cloud";
    case Codec::kPictureBase: return "vp8";
    default: return {};
  }
}

// The quantiser's scale is 28 to 52 (core/video).
std::string quality_of(const SentAs& form) {
  const std::string word = form.quantiser <= 36 ? "good" : form.quantiser <= 45 ? "fair" : "poor";
  return form.half ? word + ", half size" : word;
}

OrderedJson sent_as_quality(const TopicStatus& topic) {
  return topic.sent_as.quantiser == 0 ? OrderedJson() : OrderedJson(quality_of(topic.sent_as));
}

// An importer is not told why; its peer has one reason to send what is not exact.
OrderedJson sent_as_because(const TopicStatus& topic) {
  const SentAs& form = topic.sent_as;
  if (!form.because.empty()) return form.because;
  return form.is_exact() ? OrderedJson() : OrderedJson("the link would carry too few exact ones");
}

OrderedJson not_exact(const TopicStatus& topic) {
  const std::string words = words_of(topic.sent_as);
  return words.empty() ? OrderedJson() : OrderedJson(words);
}

OrderedJson overload(const TopicStatus& topic) {
  if (topic.published_for_each_sent <= 1) return {};
  return fmt::format("more than the link carries: one of {:.1f} is sent",
                     topic.published_for_each_sent);
}

constexpr StatusField<TopicStatus> kTopicFields[] = {
    {"topic", Unit::kNone, get<&TopicStatus::topic>, "local name"},
    {"type", Unit::kNone, get<&TopicStatus::type>, "", {}, {"type"}},
    {"direction",
     Unit::kNone,
     direction<TopicStatus>,
     "`export` or `import`",
     {},
     {"direction", As::kText, In::kWide}},
    {"state",
     Unit::kNone,
     state<TopicStatus>,
     "one word, [below](#states)",
     {},
     {"state", As::kWord, In::kNarrow}},
    {"demanded", Unit::kNone, get<&TopicStatus::demanded>,
     "somebody subscribes where it is imported"},
    {"origins",
     Unit::kNone,
     get<&TopicStatus::origins>,
     "publishers",
     {},
     {"publishers", As::kCount}},
    {"published", Unit::kNone,
     [](const TopicStatus& t) { return t.exported ? OrderedJson(t.published()) : OrderedJson(); },
     "export: messages taken here for the peer, forwarded or not",
     counter("topic_published", "Messages taken for peers, forwarded or not")},
    {"messages",
     Unit::kNone,
     get<&TopicStatus::messages>,
     "messages forwarded",
     counter("topic_messages", "Messages sent to peers (export) or published here (import)"),
     {"messages/s", As::kGrowth, In::kNarrow, "published"}},
    {"bytes",
     Unit::kBytes,
     get<&TopicStatus::bytes>,
     "their bytes before compression",
     counter("topic_bytes", "Their bytes, before compression"),
     {"uncompressed", As::kGrowth}},
    {"wire_bytes",
     Unit::kBytes,
     get<&TopicStatus::wire_bytes>,
     "their bytes on the connection",
     counter("topic_wire_bytes", "Their bytes on the connection"),
     {"on the wire", As::kGrowth, In::kWide}},
    {"idle_seconds", Unit::kSeconds,
     [](const TopicStatus& t) {
       return t.idle ? OrderedJson(std::chrono::floor<std::chrono::seconds>(*t.idle).count())
                     : OrderedJson();
     },
     "while it is demanded: since the last message was published, or since it was demanded",
     most("topic_idle_seconds", "Time since the last message, the most of all links")},
    {"usual_rate", Unit::kNone,
     [](const TopicStatus& t) {
       return t.usual_rate ? OrderedJson(std::round(*t.usual_rate * 10) / 10) : OrderedJson();
     },
     "messages in a second before that, if many have come"},
    {"queued",
     Unit::kNone,
     get<&TopicStatus::queued>,
     "messages that wait",
     gauge("topic_queued", "Messages that wait"),
     {"queued", As::kCount, In::kWide}},
    {"dropped",
     Unit::kNone,
     dropped,
     "messages that were not delivered, by reason",
     counter("topic_dropped", "Messages that were not delivered, by reason", "reason"),
     {"dropped", As::kReasons, In::kNarrow}},
    {"lately", Unit::kNone, lately_of,
     "`messages`, `wire_bytes` and `dropped` of the last 5 to 10 minutes"},
    {"keep",
     Unit::kNone,
     [](const TopicStatus& t) {
       return t.exported ? OrderedJson(word_of(kKeepWords, t.keep)) : OrderedJson();
     },
     "export: which messages wait where the link carries less than is published",
     {},
     {"keeps in overload"}},
    {"keep_because",
     Unit::kNone,
     [](const TopicStatus& t) { return t.exported ? OrderedJson(t.keep_because) : OrderedJson(); },
     "export: why",
     {},
     {"keeps it because"}},
    {"sent_as",
     Unit::kNone,
     sent_as,
     "the form of the last message: `planes` (a picture, exact), `vp8` (a picture as video, not "
     "exact) or `cloud`",
     {},
     {"sent as"}},
    {"sent_as_step",
     Unit::kNone,
     [](const TopicStatus& t) {
       return t.sent_as.step_um > 0 ? OrderedJson(t.sent_as.step_um / 1e6) : OrderedJson();
     },
     "its points are rounded to multiples of so many metres; absent: it is exact",
     most("topic_rounded_to_metres", "Points of the last cloud are rounded to multiples of this"),
     {"rounded to"}},
    {"sent_as_quality",
     Unit::kNone,
     sent_as_quality,
     "how good its video is: `good`, `fair` or `poor`, and whether it has `half size`",
     {},
     {"quality"}},
    {"sent_as_quantiser", Unit::kNone,
     [](const TopicStatus& t) {
       return t.sent_as.quantiser == 0 ? OrderedJson() : OrderedJson(t.sent_as.quantiser);
     },
     "the same as a number: 28 is the best, 52 the worst",
     most("topic_picture_quantiser",
          "Quantiser of the last picture that was sent or came as video: 28 is the best, 52 the "
          "worst")},
    {"sent_as_because",
     Unit::kNone,
     sent_as_because,
     "why it is not exact, or lacks points; an import does not show the latter",
     {},
     {"not exact because"}},
    {"not_exact", Unit::kNone, not_exact,
     "the form of the last message in words, unless it is exact; the page and `ctl status` mark "
     "the "
     "topic with `~`"},
    {"rule", Unit::kNone, if_any<&TopicStatus::rule>, "the rule here that allows it", {}, {"rule"}},
    {"misfit",
     Unit::kNone,
     if_any<&TopicStatus::misfit>,
     "import: the QoS policy that a subscriber here requests and no publisher offers",
     {},
     {"QoS misfit"}},
    {"latency_ms",
     Unit::kMilliseconds,
     [](const TopicStatus& t) {
       const bool is_old = !t.latency_ms || state_of(t) == StateWord::kQuiet;
       return is_old ? OrderedJson() : OrderedJson(*t.latency_ms);
     },
     "of the last message: its age at its publication here (import), its wait before it was sent "
     "(export); absent while the topic is quiet",
     most("topic_age_seconds",
          "Age of the last message at its publication here, the most of all "
          "links"),
     {"age", As::kText, In::kWide}},
    {"wheel", Unit::kNone, [](const TopicStatus& t) { return wheel_word(t.wheel); },
     "of a topic that drives the robot: who steers"},
    {"also_from", Unit::kNone, if_any<&TopicStatus::also_from>,
     "import: a node here that publishes it, too"},
    {"ahead_ms", Unit::kMilliseconds,
     [](const TopicStatus& t) { return t.ahead_ms ? OrderedJson(*t.ahead_ms) : OrderedJson(); },
     "of a topic that drives the robot: the clock of a publisher's machine is ahead of its "
     "bridge's"},
    {"overload",
     Unit::kNone,
     overload,
     "in words, while the link carries less than is published",
     {},
     {"overload"}},
    {"declined",
     Unit::kNone,
     if_any<&TopicStatus::declined>,
     "export: why the peer does not import it",
     {},
     {"declined"}},
    {"declined_code", Unit::kNone, if_any<&TopicStatus::declined_code>,
     "export: the same as a word of `decline` ([protocol.md](protocol.md))"},
};

// ---- services

OrderedJson lately_of_service(const ServiceStatus& service) {
  if (!service.lately) return {};
  return {{"answered", service.lately->answered},
          {"timed_out", service.lately->timed_out},
          {"refused", service.lately->refused},
          {"lost", service.lately->lost}};
}

constexpr StatusField<ServiceStatus> kServiceFields[] = {
    {"service", Unit::kNone, get<&ServiceStatus::service>, "local name"},
    {"type", Unit::kNone, get<&ServiceStatus::type>, "", {}, {"type"}},
    {"direction",
     Unit::kNone,
     direction<ServiceStatus>,
     "`export` or `import`",
     {},
     {"direction", As::kText, In::kWide}},
    {"state",
     Unit::kNone,
     state<ServiceStatus>,
     "one word, [below](#states)",
     {},
     {"state", As::kWord, In::kNarrow}},
    {"attached", Unit::kNone, get<&ServiceStatus::attached>, "calls can be made"},
    {"also_here", Unit::kNone, if_set<&ServiceStatus::also_here>,
     "import, true: a node here serves it, so the peer's server is not reached from here"},
    {"several_here", Unit::kNone, if_set<&ServiceStatus::several_here>,
     "export, true: several nodes here serve it, and each call reaches all of them"},
    {"pending",
     Unit::kNone,
     get<&ServiceStatus::pending>,
     "calls without an answer",
     gauge("service_calls_under_way", "Calls without an answer"),
     {"pending", As::kCount, In::kNarrow}},
    {"oldest_seconds", Unit::kSeconds,
     [](const ServiceStatus& s) {
       return s.oldest ? OrderedJson(std::chrono::floor<std::chrono::seconds>(*s.oldest).count())
                       : OrderedJson();
     },
     "how long the oldest of them has waited",
     most("service_oldest_call_seconds", "How long the oldest call without an answer has waited")},
    {"waiting",
     Unit::kNone,
     get<&ServiceStatus::waiting>,
     "export: of these, calls that wait for their turn",
     {},
     {"waiting", As::kCount}},
    {"calls",
     Unit::kNone,
     get<&ServiceStatus::calls>,
     "calls that were begun",
     counter("service_calls", "Calls that were begun"),
     {"calls", As::kCount, In::kNarrow}},
    {"answered",
     Unit::kNone,
     get<&ServiceStatus::answered>,
     "",
     counter("service_calls_ended", "Calls that have ended, by how", "how"),
     {"answered", As::kCount, In::kWide}},
    {"refused", Unit::kNone, get<&ServiceStatus::refused>, "at a limit, or impossible",
     counter("service_calls_ended", "", "how")},
    {"timed_out", Unit::kNone, get<&ServiceStatus::timed_out>,
     "given up after the rule's `call_timeout`", counter("service_calls_ended", "", "how")},
    {"forgotten", Unit::kNone, get<&ServiceStatus::forgotten>, "their caller went away",
     counter("service_calls_ended", "", "how")},
    {"lost", Unit::kNone, get<&ServiceStatus::lost>, "with the link or the server",
     counter("service_calls_ended", "", "how")},
    {"duplicates",
     Unit::kNone,
     get<&ServiceStatus::duplicates>,
     "requests or answers that came twice or late",
     {},
     {"duplicates", As::kCount}},
    {"lately", Unit::kNone, lately_of_service,
     "`answered`, `timed_out`, `refused` and `lost` of the last 5 to 10 minutes"},
    {"request_bytes", Unit::kBytes, get<&ServiceStatus::request_bytes>, ""},
    {"response_bytes", Unit::kBytes, get<&ServiceStatus::response_bytes>, ""},
    {"rule",
     Unit::kNone,
     if_any<&ServiceStatus::rule>,
     "the rule here that allows it",
     {},
     {"rule"}},
    {"declined",
     Unit::kNone,
     if_any<&ServiceStatus::declined>,
     "export: why the peer does not import it",
     {},
     {"declined"}},
    {"declined_code", Unit::kNone, if_any<&ServiceStatus::declined_code>,
     "export: the same as a word of `decline` ([protocol.md](protocol.md))"},
};

// ---- missing names

constexpr StatusField<MissingName> kMissingFields[] = {
    {"kind",
     Unit::kNone,
     [](const MissingName& m) { return OrderedJson(word_of(kKindWords, m.kind)); },
     "`topic`, `service` or `action`",
     {},
     {"kind", As::kText, In::kWide}},
    {"name", Unit::kNone, get<&MissingName::name>, "local name"},
    {"type", Unit::kNone, get<&MissingName::type>, "", {}, {"type"}},
    {"direction",
     Unit::kNone,
     direction<MissingName>,
     "`export` or `import`",
     {},
     {"direction", As::kText, In::kWide}},
    {"reason", Unit::kNone,
     [](const MissingName& m) { return OrderedJson(word_of(kMissingWords, m.reason)); },
     "[one word](#what-is-not-forwarded)"},
    {"text",
     Unit::kNone,
     get<&MissingName::text>,
     "the same as a sentence",
     {},
     {"why", As::kText, In::kNarrow}},
    {"rule", Unit::kNone, if_any<&MissingName::rule>, "the rule here that decides", {}, {"rule"}},
    {"waits", Unit::kNone,
     [](const MissingName& m) { return OrderedJson(word_of(kWaitingWords, m.waits)); },
     "who waits for it: `here`, `peer`, `sender` (a node here sends it) or `nobody`"},
    {"code", Unit::kNone, if_any<&MissingName::code>,
     "for `declined`: the word of `decline` ([protocol.md](protocol.md))"},
};

// ---- the words of codes

// Words that people understand without these documents, behind a number where they count.
constexpr std::pair<std::string_view, std::string_view> kPlainWords[] = {
    {"queue_depth", "displaced in the queue"},
    {"queue_bytes", "beyond the bytes of the queue"},
    {"queue_time", "waited too long"},
    {"lifespan", "older than their lifespan"},
    {"max_age", "older than max_age"},
    {"rate", "above the rule's rate"},
    {"no_demand", "no longer wanted"},
    {"withdrawn", "no longer offered"},
    {"link_lost", "lost with the link"},
    {"unknown_origin", "of an unknown publisher"},
    {"duplicate", "delivered before"},
    {"newer_available", "replaced by newer"},
    {"publish_failed", "refused by the middleware"},
    {"memory", "at memory_max"},
    {"resume_bound", "too many for the break"},
    {"lost_here", "lost in the middleware"},
    {"wheel", "not of the driver"},
    {"group", "after a lost video packet"},
    {"forgotten", "without their caller"},
    {"kept", "kept for later"},
    {"gave_way", "closed for newer ones"},
    {"shut_out", "put off after offences"},
    {"logins_without_place", "logins without a place"},
};

// Who drives, as the robot's side says it of the peer, and the operator's of itself.
struct WheelWords {
  std::string_view code, at_robot, at_operator;
};
constexpr WheelWords kWheelWords[] = {
    {"free", "nobody drives", "nobody drives"},
    {"yours", "drives the robot", "you drive the robot"},
    {"taken", "another operator drives", "another operator drives"},
    {"halted", "halted: has to let go first", "halted: let go first"},
};

// ---- views of the table

std::string_view word_of(Unit unit) {
  constexpr std::string_view kWords[] = {"", "bytes", "bytes/s", "ms", "s"};
  return kWords[static_cast<std::size_t>(unit)];
}

template <class Of>
OrderedJson columns(std::span<const StatusField<Of>> fields) {
  constexpr std::string_view kAs[] = {"text", "word", "count", "growth", "reasons"};
  constexpr std::string_view kIn[] = {"narrow", "wide", "detail"};
  OrderedJson all = OrderedJson::array();
  for (const StatusField<Of>& field : fields) {
    const Column& column = field.column;
    if (column.title.empty()) continue;
    all.push_back({{"name", field.name},
                   {"title", column.title},
                   {"says", field.says},
                   {"unit", word_of(field.unit)},
                   {"as", kAs[static_cast<std::size_t>(column.as)]},
                   {"in", kIn[static_cast<std::size_t>(column.in)]},
                   {"part_of", column.part_of}});
  }
  return all;
}

template <class Of>
std::string table(std::string_view before, std::span<const StatusField<Of>> fields) {
  std::string text = "| member | unit | meaning |\n| --- | --- | --- |\n";
  for (const StatusField<Of>& field : fields)
    text +=
        fmt::format("| `{}{}` | {} | {} |\n", before, field.name, word_of(field.unit), field.says);
  return text;
}

std::string words_table() {
  std::string text = "| code | words |\n| --- | --- |\n";
  for (const auto& [code, words] : kPlainWords) text += fmt::format("| `{}` | {} |\n", code, words);
  return text;
}

}  // namespace

std::string words_of(const SentAs& form) {
  if (form.quantiser > 0) return "video, " + quality_of(form);
  if (form.step_um > 0) return fmt::format("points rounded to {} mm", form.step_um / 1e3);
  return form.because.empty() ? "" : "points left out";
}

std::span<const StatusField<StatusPicture>> side_fields() {
  return kSideFields;
}
std::span<const StatusField<LinkStatus>> link_fields() {
  return kLinkFields;
}
std::span<const StatusField<TopicStatus>> topic_fields() {
  return kTopicFields;
}
std::span<const StatusField<ServiceStatus>> service_fields() {
  return kServiceFields;
}
std::span<const StatusField<MissingName>> missing_fields() {
  return kMissingFields;
}

std::string plain_words(std::string_view code) {
  for (const auto& [known, words] : kPlainWords)
    if (code == known) return std::string(words);
  std::string words(code);
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

std::string_view wheel_words(std::string_view code, bool at_robot) {
  for (const WheelWords& words : kWheelWords)
    if (words.code == code) return at_robot ? words.at_robot : words.at_operator;
  return {};
}

OrderedJson page_columns() {
  OrderedJson words = OrderedJson::object(), wheel = OrderedJson::object();
  for (const auto& [code, at_robot, at_operator] : kWheelWords)
    wheel[std::string(code)] = {{"import", at_robot}, {"export", at_operator}};
  for (const auto& [code, plain] : kPlainWords) words[std::string(code)] = plain;
  return {{"topics", columns(topic_fields())},
          {"services", columns(service_fields())},
          {"missing", columns(missing_fields())},
          {"words", std::move(words)},
          {"wheel", std::move(wheel)}};
}

std::string status_tables() {
  return "### The side\n\n" + table("", side_fields()) + "\n### `links[]`\n\n" +
         table("", link_fields()) + "\n### `links[].topics[]`\n\n" + table("", topic_fields()) +
         "\n### `links[].services[]`\n\n" + table("", service_fields()) +
         "\n### `links[].missing[]`\n\n" + table("", missing_fields()) +
         "\n### Words of the page and the terminal\n\n" + words_table();
}

}  // namespace connect_bridge
