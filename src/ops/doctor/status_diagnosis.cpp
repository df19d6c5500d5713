#include "ops/doctor/status_diagnosis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "config/rule_rows.hpp"
#include "config/syntax.hpp"
#include "core/driving/command.hpp"
#include "core/ports/failure.hpp"
#include "core/wire/words.hpp"
#include "ops/doctor/diagnosis.hpp"
#include "ops/doctor/worth_telling.hpp"
#include "ops/status/json_members.hpp"
#include "ops/status/peer_findings.hpp"
#include "ops/status/program_of_link.hpp"

namespace connect_bridge {
namespace {

constexpr double kClockOffsetMs = 1000;
constexpr double kClockApartMs = 100;  // tf2 fails from about here on
constexpr double kOpenSeconds = 10;    // until something may be expected of a link
constexpr std::size_t kBreaks = 3;     // in this time
constexpr double kBreaksSeconds = 600;
constexpr double kMostOfAge = 0.8;    // of a rule's max_age
constexpr double kRoundTripMs = 800;  // more than by a satellite
constexpr double kServersLost = 3;
constexpr double kFragmented = 32'000;  // bytes; some of these fill a publisher's shared memory
constexpr double kStopped = 10;         // s without a message
constexpr double kSeveral = 2;          // messages in a second
constexpr double kLongCall = 10;        // s, as the log says it
constexpr char kItsWords[] = "\"here\" and \"this side\" are the other end";
constexpr double kPatient = 1;   // s, of `dead_after`; less is shorter than usual silences
constexpr double kUnheard = 10;  // s; a peer acknowledges at once
constexpr std::size_t kKeyBytes = 100;
constexpr double kShortBreak = 1;     // s
constexpr double kLargeBytes = 1000;  // a message that needs a large packet
constexpr double kCrawls = 5000;      // bytes/s; a path on which large packets get through has more
constexpr double kForgottenAge = 20;  // s; less is no time in which a path forgets
constexpr double kSameAge = 1.25;     // the oldest of connections of one age, by the youngest
constexpr double kLimitShare = 0.8;   // of a limit: it is what slows down
constexpr double kDroppedShare = 0.05;
constexpr double kStarvedShare = 0.95;   // of what a rule's rate keeps, on purpose as it seems
constexpr double kStarvedHere = 0.5;     // the same where it is imported: it has crossed in vain
constexpr double kSteadyShare = 0.2;     // of commands: more than a moment's
constexpr double kSegments = 100;        // less says nothing about a path
constexpr double kShortestLately = 300;  // s, the time of counts called lately, at least
constexpr double kAmple = 2;
constexpr double kTimesHeldUp = 3;      // lately; less may be one busy moment of the machine
constexpr double kHeldUpOnceMs = 3000;  // no busy moment: peers gave this side up meanwhile

// The finding that the importer's code of a declined channel means (docs/protocol.md, "decline").
std::string_view finding_of_decline(const std::string& code, bool is_exported) {
  if (code == "type_unknown") return "type_not_installed";
  if (code == "type_mismatch") return "definitions_differ";
  if (code == "not_permitted") return is_exported ? "not_taken" : "declined";
  return "declined";
}

// The finding of a missing name. Most reasons are findings.
std::string_view finding_of_missing(const std::string& reason, const std::string& code,
                                    bool is_exported) {
  if (reason == "type_unknown") return "type_not_installed";
  if (reason == "declined") return finding_of_decline(code, is_exported);
  const Finding* const same = finding_of(reason);
  return same ? same->id : "declined";
}

// The finding of a server's failure at its relay: the keys are others than those of a client.
std::string_view finding_at_relay(Cause cause) {
  switch (cause) {
    case Cause::kHostUnknown:
    case Cause::kResolverSilent:
    case Cause::kPortClosed:
    case Cause::kNoRoute:
    case Cause::kNoAnswer:
    case Cause::kServerSilent:
    case Cause::kRelayUnreachable: return "relay_unreachable";
    case Cause::kCertificateEarly:
    case Cause::kCertificateExpired:
    case Cause::kCertificateName:
    case Cause::kCertificateForeign:
    case Cause::kCertificatePurpose:
    case Cause::kCertificateFiles:
    case Cause::kOtherKey: return "relay_certificate";
    case Cause::kTokenMissing: return "relay_token_missing";
    case Cause::kTlsToPlainPort:
    case Cause::kNotThisProgram: return "relay_is_none";
    case Cause::kRelayRefuses: return "relay_refuses";
    case Cause::kRobotTwice: return "robots_with_one_token";
    default: return "relay_fails";
  }
}

class Doctor {
 public:
  explicit Doctor(const SideFacts& facts) : facts_(facts) {}
  void side(const Json& status);
  std::map<LinkId, std::vector<PeerFinding>> for_peers(const Json& status);
  void relay(const Json& status);
  std::vector<Found> take();

 private:
  void know(const Json& status);
  void add(std::string_view id, std::string subject = {}, std::string detail = {},
           bool waits = false) {
    found_.push_back({id, std::move(subject), std::move(detail), waits});
  }
  void way(const Json& status);
  void relays(const Json& status);
  void resources(const Json& status);
  void certificate(const Json& status);
  void link(const Json& link);
  void path(const Json& link, const std::string& who);
  // Whether it breaks again and again.
  bool breaks(const Json& link, const std::string& who);
  void identities(const Json& links);
  void restarts(const Json& links);
  [[nodiscard]] bool is_missed(const Json& name) const;
  [[nodiscard]] std::string moved_node(const std::string& name) const;
  [[nodiscard]] const RuleName* misplaced(const Json& name) const;
  [[nodiscard]] bool opens_actions() const;
  [[nodiscard]] RuleFacts rule_of(const Json& topic) const;
  void missing(const Json& link);
  void topic(const Json& link, const Json& topic);
  void service(const Json& service);
  void silent_topics(const Json& link);
  void peer_findings(const Json& link, const std::string& who);
  void thin(const Json& link);

  const SideFacts facts_;
  bool is_client_ = false;
  bool is_robot_ = true;
  std::string node_;
  std::string prefix_;
  bool carries_ = false;  // something crosses, or has
  std::optional<double> now_;
  std::set<std::string> halting_;  // rules by which a topic comes that can be halted
  std::vector<Found> found_;
};

std::vector<Found> Doctor::take() {
  const auto is = [](std::string_view id) {
    return [id](const Found& one) { return one.id == id; };
  };
  const auto is_own = [&](const Found& one) {
    return one.id == "clocks_differ" && one.program.empty();
  };
  if (std::any_of(found_.begin(), found_.end(), is_own)) std::erase_if(found_, is("clocks_apart"));
  // The other end says the same of the same name.
  std::set<std::pair<std::string_view, std::string>> own;
  for (const Found& one : found_)
    if (one.program.empty() && !one.subject.empty()) own.insert({one.id, one.subject});
  std::erase_if(found_, [&](const Found& one) {
    return !one.program.empty() && own.contains({one.id, one.subject});
  });
  return gathered(found_);
}

// Counts of the last minutes; of all time where the program is older.
const Json& lately_of(const Json& of) {
  const Json& lately = part_of(of, "lately");
  return lately.empty() ? of : lately;
}

double lately_in(const Json& of, const char* name) {
  return number_in(lately_of(of), name);
}

// Topics that nodes share, with names or frames of their own in what they say.
bool is_shared_by_nodes(const std::string& topic) {
  return topic == "/tf" || topic == "/tf_static" || topic == "/diagnostics" || topic == "/rosout" ||
         topic == "/joint_states" || topic.find("/_action/") != std::string::npos;
}

// Topics that there are without anybody's doing.
bool is_of_every_node(const std::string& topic) {
  return topic == "/diagnostics" || topic == "/rosout" || topic == "/parameter_events";
}

bool is_exported(const Json& of) {
  return text_in(of, "direction") == "export";
}

// Most of what a robot publishes is not to be elsewhere, and RViz has tools that nobody uses. A
// robot also listens to much that nobody is to send, or not yet: while anything crosses, its rules
// are as they are meant.
bool Doctor::is_missed(const Json& name) const {
  const std::string waits = text_in(name, "waits"), reason = text_in(name, "reason");
  const bool is_rule_here = reason == "no_rule" || reason == "denied" || reason == "other_peer";
  const bool is_for_later = reason == "not_there" && text_in(name, "kind") == "topic";
  if (!is_exported(name)) return !(is_rule_here || is_for_later) || !is_robot_ || !carries_;
  const bool is_rule = is_rule_here || reason == "not_taken";
  return !is_rule || waits == "peer" || (waits == "sender" && !is_robot_);
}

// "; the namespace of this program is no prefix: `prefix: /robot1`", where a name is below the
// namespace of the node, or nothing.
std::string Doctor::moved_node(const std::string& name) const {
  const std::string space = node_.substr(0, node_.rfind('/'));
  if (!prefix_.empty() || space.empty() || space.size() == node_.size() ||
      !name.starts_with(space + "/"))
    return {};
  return "; the namespace of this program's node is no prefix: set `prefix: " + space + "`";
}

// A publisher's shared memory has room for many small messages.
std::string_view finding_of_loss(const Json& link, const std::string& name) {
  for (const Json& topic : part_of(link, "topics"))
    if (is_exported(topic) && text_in(topic, "topic") == name &&
        number_in(topic, "bytes") < kFragmented * number_in(topic, "messages"))
      return "lost_in_bursts";
  return "lost_in_middleware";
}

// A name that no rule allows may stand in one below the key of another kind: an action below
// `export_services`. Null: it does not.
const RuleName* Doctor::misplaced(const Json& name) const {
  if (text_in(name, "reason") != "no_rule") return nullptr;
  const std::string kind = text_in(name, "kind");
  const auto own = kind == "action"    ? OpenedBy::kActions
                   : kind == "service" ? OpenedBy::kServices
                                       : OpenedBy::kTopics;
  const auto direction = is_exported(name) ? Direction::kExport : Direction::kImport;
  std::string local = text_in(name, "name");
  if (local.starts_with(prefix_ + "/")) local.erase(0, prefix_.size());
  if (!is_canonical_name(local)) return nullptr;
  const auto found = std::find_if(facts_.names.begin(), facts_.names.end(), [&](const auto& one) {
    const bool is_telling = own == OpenedBy::kActions || !has_wildcard(one.pattern.text());
    return one.direction == direction && one.kind != own && is_telling &&
           one.pattern.matches(local);
  });
  return found == facts_.names.end() ? nullptr : &*found;
}

bool Doctor::opens_actions() const {
  return std::any_of(facts_.names.begin(), facts_.names.end(),
                     [](const RuleName& one) { return one.kind == OpenedBy::kActions; });
}

void Doctor::missing(const Json& link) {
  for (const Json& name : part_of(link, "missing")) {
    const RuleName* const place = misplaced(name);
    // A topic and a service may share a name; nobody writes an action's name for anything else.
    // Who opens all services and topics, and no action at all, has forgotten them.
    const bool is_action_meant = place != nullptr && text_in(name, "kind") == "action" &&
                                 (!has_wildcard(place->pattern.text()) || !opens_actions());
    if (!is_missed(name) && !is_action_meant) continue;
    const std::string reason = text_in(name, "reason"), waits = text_in(name, "waits");
    const auto finding = reason == "lost"
                             ? finding_of_loss(link, text_in(name, "name"))
                             : finding_of_missing(reason, text_in(name, "code"), is_exported(name));
    // What this side declines may be what nobody here wants.
    const bool is_declined = !is_exported(name) && reason == "declined" && waits == "nobody";
    add(finding, text_in(name, "name"),
        text_in(name, "text") + (reason == "not_given" ? moved_node(text_in(name, "name")) : "") +
            (place == nullptr
                 ? ""
                 : fmt::format("; rule.{}.{} names it, but not as {}", place->rule, place->key,
                               text_in(name, "kind") == "action" ? "an action"
                                                                 : "a " + text_in(name, "kind"))),
        is_exported(name) ? waits == "peer" : !is_declined);
    found_.back().is_hint = is_declined;
  }
}

RuleFacts Doctor::rule_of(const Json& topic) const {
  const auto found = facts_.rules.find(text_in(topic, "rule"));
  return found == facts_.rules.end() ? RuleFacts() : found->second;
}

void Doctor::topic(const Json& link, const Json& topic) {
  const std::string name = text_in(topic, "topic");
  const Json& dropped = part_of(lately_of(topic), "dropped");
  const double messages = lately_in(topic, "messages");
  const auto many = [&](const char* reason, double share) {
    const double count = number_in(dropped, reason);
    return count > 0 && count >= share * (messages + count);
  };
  const auto counted = [&](const char* reason) {
    return fmt::format("{} {:.0f} of {:.0f}", reason, number_in(dropped, reason),
                       messages + number_in(dropped, reason));
  };
  if (const std::string node = text_in(topic, "also_from");
      !node.empty() && messages > 0 && is_set(topic, "demanded") && !is_shared_by_nodes(name))
    add("published_here_too", name, node, true);
  const RuleFacts rule = rule_of(topic);
  const std::string rule_name = text_in(topic, "rule");
  const std::string by_rule = rule_name.empty() ? "" : ", by the rule " + rule_name;
  const double starved = is_exported(topic) ? kStarvedShare : kStarvedHere;
  if (many("rate", rule.limits_bytes ? kDroppedShare : starved))
    add("drops_rate", name, counted("rate") + by_rule);
  if (many("too_large", kDroppedShare)) add("drops_too_large", name, counted("too_large"), true);
  if (many("memory", kDroppedShare)) add("drops_memory", name, counted("memory"), true);
  const std::string wheel = text_in(topic, "wheel");
  // Drops of the last minutes, and who steers now: who has the wheel alone, or whoever steers after
  // another one, lacks nothing.
  if (many("wheel", kDroppedShare)) {
    if (wheel == "halted") add("let_go_first", name, counted("wheel"));
    if (wheel == "taken" || wheel.empty()) add("another_drives", name, counted("wheel"));
    if (wheel == "yours" && number_in(topic, "origins") > 1 && many("wheel", kSteadyShare))
      add("two_of_one_driver", name, counted("wheel"));
  }
  if (is_robot_ && rule.halts && !is_exported(topic) && !halting_.contains(text_in(topic, "rule")))
    add("halts_nothing", name, text_in(topic, "type"));
  if (is_exported(topic) && messages > 0 && wheel == "taken") add("another_drives", name);
  if (is_exported(topic) && messages > 0 && wheel == "halted") add("let_go_first", name);
  if (const double ahead = number_in(topic, "ahead_ms"); ahead > 0)
    add("publisher_ahead", name, fmt::format("by {:.1f} s", ahead / 1e3), true);
  if (!many("max_age", kDroppedShare)) return;
  const double offset = number_in(part_of(link, "clock"), "offset_ms");
  const bool all = number_in(dropped, "max_age") > 0 && messages == 0;
  const double way_ms = number_in(part_of(link, "clock"), "round_trip_ms") / 2;
  if (rule.max_age > 0 && way_ms >= kMostOfAge * 1e3 * rule.max_age)
    return add(
        "path_too_long", name,
        fmt::format("one way takes {:.0f} ms, max_age is {:.0f} ms", way_ms, rule.max_age * 1e3),
        true);
  // A halted driver's commands are dropped, whatever their age.
  if (wheel == "halted") return;
  if (std::abs(offset) >= kClockOffsetMs)
    add("clocks_differ", name, fmt::format("by {:.1f} s", offset / 1e3), true);
  else
    add(all ? "stamps_old" : "drops_max_age", name, counted("max_age"), true);
}

void Doctor::service(const Json& service) {
  const std::string name = text_in(service, "service");
  const double late = lately_in(service, "timed_out");
  const double refused = lately_in(service, "refused"), lost = lately_in(service, "lost");
  const double oldest = number_in(service, "oldest_seconds");
  const bool is_of_action = name.find("/_action/") != std::string::npos;
  if (is_set(service, "several_here")) add("several_servers", name);
  if (is_set(service, "also_here") && !is_of_action) add("served_here_too", name);
  if (late > 0 && lately_in(service, "answered") == 0)
    add("service_silent", name, fmt::format("{:.0f} calls timed out, none was answered", late),
        true);
  else if (is_exported(service) && !is_of_action && lost >= kServersLost &&
           lately_in(service, "answered") == 0)
    add("server_ends", name, fmt::format("{:.0f} calls were lost", lost), true);
  else if (refused > 0 && lately_in(service, "answered") == 0)
    add("calls_refused", name, fmt::format("{:.0f} calls, none was answered", refused), true);
  else if (oldest >= kLongCall && !name.ends_with("/_action/get_result"))
    add("calls_wait", name,
        fmt::format("{:.0f} calls, the oldest for {:.0f} s", number_in(service, "pending"),
                    oldest) +
            (number_in(service, "waiting") > 0
                 ? fmt::format(", of which {:.0f} wait for a place", number_in(service, "waiting"))
                 : ""),
        true);
}

// A sensor that publishes is never quiet for long.
bool is_stream(const std::string& type) {
  constexpr std::string_view kStreams[] = {
      "sensor_msgs/msg/Image",     "sensor_msgs/msg/CompressedImage",
      "sensor_msgs/msg/LaserScan", "sensor_msgs/msg/PointCloud2",
      "sensor_msgs/msg/Imu",
  };
  return std::find(std::begin(kStreams), std::end(kStreams), type) != std::end(kStreams);
}

// Measurements come as long as there is something to measure. Others end with their task: commands,
// plans, feedback; and a person lets go of a stick.
bool is_measured(std::string_view type) {
  return (type.starts_with("sensor_msgs/msg/") && !type.starts_with("sensor_msgs/msg/Joy")) ||
         type == "nav_msgs/msg/Odometry" || type == "tf2_msgs/msg/TFMessage";
}

// It came several times in a second, and comes no longer.
bool has_stopped(const Json& topic) {
  if (text_in(topic, "topic").ends_with("/tf_static")) return false;
  return number_in(topic, "idle_seconds") >= kStopped &&
         number_in(topic, "usual_rate") >= kSeveral && is_measured(text_in(topic, "type"));
}

// Topics on which nothing happens. Some topics carry little, and links that nobody uses now are
// usual: beside a sensor, only a side on which nothing happens at all is worth a word.
void Doctor::silent_topics(const Json& link) {
  if (number_in(link, "open_seconds") < kOpenSeconds) return;
  bool demanded_any = false;
  std::vector<std::string> silent, lonely;
  for (const Json& topic : part_of(link, "topics")) {
    const std::string name = text_in(topic, "topic");
    const bool demanded = is_set(topic, "demanded");
    demanded_any = demanded_any || demanded;
    if (!is_exported(topic)) continue;
    if (!demanded && text_in(topic, "declined").empty() && !carries_ && !is_of_every_node(name))
      lonely.push_back(name);
    else if (!demanded && text_in(topic, "declined").empty() && !is_robot_ &&
             number_in(topic, "origins") > 0 && driving::command_type(text_in(topic, "type")))
      add("no_listener", name);
    if (demanded && number_in(topic, "origins") > 0 && has_stopped(topic))
      add("publisher_stops", name,
          fmt::format("for {:.0f} s; before that {:.0f} in a second",
                      number_in(topic, "idle_seconds"), number_in(topic, "usual_rate")),
          true);
    if (carries_ && (number_in(topic, "messages") > 0 || !is_stream(text_in(topic, "type"))))
      continue;
    if (demanded && number_in(topic, "origins") > 0 && part_of(topic, "dropped").empty() &&
        number_in(topic, "queued") == 0 && name.find("/_action/") == std::string::npos)
      silent.push_back(name);
  }
  for (const std::string& name : silent) add("nothing_arrives", name, {}, true);
  if (!demanded_any)
    for (const std::string& name : lonely) add("no_listener", name);
}

bool may_be_lossy(const std::string& type) {
  return type == "sensor_msgs/msg/Image" || type == "sensor_msgs/msg/CompressedImage" ||
         type == "sensor_msgs/msg/PointCloud2";
}

// The finding of a thin link names the heaviest of the topics that lose messages to it. A path that
// could carry all of it is not thin.
void Doctor::thin(const Json& link) {
  const Json* heaviest = nullptr;
  double published = 0;  // bytes, as far as known
  for (const Json& topic : part_of(link, "topics")) {
    const Json& dropped = part_of(lately_of(topic), "dropped");
    const double lost = number_in(dropped, "newer_available") + number_in(dropped, "queue_time") +
                        number_in(dropped, "queue_bytes") + number_in(dropped, "group");
    const double messages = lately_in(topic, "messages"), sent = lately_in(topic, "wire_bytes");
    if (messages > 0) published += sent * (messages + lost) / messages;
    if (lost == 0 || lost < kDroppedShare * (lost + messages)) continue;
    if (!heaviest || sent > lately_in(*heaviest, "wire_bytes")) heaviest = &topic;
  }
  const double rate = number_in(link, "rate_bytes_per_second");
  const double seconds = std::min(kShortestLately, number_in(link, "open_seconds"));
  if (!heaviest) return;
  // A path that carries less than the limit is known to.
  const auto limit = static_cast<double>(facts_.bytes_per_second);
  if (limit > 0 && (rate == 0 || rate >= kLimitShare * limit))
    return add("own_limit", text_in(*heaviest, "topic"),
               fmt::format("`{}` is {:.0f} bytes/s", facts_.limit_key, limit), true);
  if (published > 0 && rate * seconds > published * kAmple) return;
  const RuleFacts rule = rule_of(*heaviest);
  const std::string type = text_in(*heaviest, "type");
  const char* const exact_by = rule.exact && may_be_lossy(type) ? "; its rule says `lossy: never`"
                               : !facts_.video && video::has_pictures(type)
                                   ? "; this build has no video"
                                   : "";
  add(rule.urgent ? "urgent_is_heavy" : "link_too_thin", text_in(*heaviest, "topic"),
      fmt::format("it is the heaviest: {:.1f} MB; the path carries {:.0f} kB/s{}",
                  lately_in(*heaviest, "wire_bytes") / 1e6, rate / 1e3, exact_by),
      true);
}

// Whether it seems that small packets cross and large ones do not: a topic of large messages
// crawls, or brings nothing.
bool misses_large(const Json& link) {
  const bool crawls = number_in(link, "rate_bytes_per_second") < kCrawls;
  for (const Json& topic : part_of(link, "topics")) {
    if (!is_set(topic, "demanded")) continue;
    const double messages = number_in(topic, "messages");
    const bool waits = messages == 0 && number_in(topic, "origins") > 0;
    if (waits && (!is_exported(topic) || number_in(topic, "queued") > 0)) return true;
    if (is_exported(topic) && crawls && messages > 0 &&
        number_in(topic, "wire_bytes") >= kLargeBytes * messages)
      return true;
  }
  return false;
}

// Connections that had the same age when they broke: something on the path counts.
bool are_of_one_age(const std::vector<double>& ages) {
  if (ages.size() + 1 < kBreaks) return false;
  const auto [youngest, oldest] = std::minmax_element(ages.begin(), ages.end());
  return *youngest > 0 && *oldest <= kSameAge * *youngest;
}

// Breaks of the last ten minutes. Where large packets vanish, the silence ends as soon as a new
// connection begins with small ones; the peer may notice it first, and replaces its connection.
bool Doctor::breaks(const Json& link, const std::string& who) {
  std::size_t lost = 0, silent = 0, replaced = 0, short_ones = 0, ended = 0;
  std::vector<double> ages;
  std::optional<double> began;
  std::string last;
  for (const Json& one : part_of(link, "breaks")) {
    const auto since = moment_in(one, "lost");
    const std::string code = text_in(one, "code");
    if (!since || !now_ || *now_ - *since > kBreaksSeconds) continue;
    if (code == "going_away" || code == "normal") continue;
    ++(code == "replaced" ? replaced : code == "silent" ? silent : lost);
    if (code == "connection_lost") ++ended;
    if (began) ages.push_back(*since - *began);
    began = moment_in(one, "back");
    const bool ended_at_once = one.contains("seconds") && number_in(one, "seconds") < kShortBreak;
    if (ended_at_once && code != "connection_lost") ++short_ones;
    if (code != "replaced") last = text_in(one, "reason");
  }
  const std::size_t all = lost + silent + replaced;
  const bool vanish = silent + replaced > 0 && 2 * short_ones > all && misses_large(link);
  const bool is_impatient = silent > 0 && facts_.dead_after > 0 && facts_.dead_after < kPatient;
  const bool is_of_one_age = are_of_one_age(ages);
  const double age = ages.empty() ? 0 : *std::min_element(ages.begin(), ages.end());
  // A robot that changes its network replaces connections, too.
  const std::size_t breaks = silent > 0 || vanish ? all : lost;
  if (breaks < kBreaks) return false;
  const std::string_view id =
      vanish ? "large_packets_vanish"
      : 2 * silent > breaks && is_of_one_age && age >= kForgottenAge && !is_impatient
          ? "connections_forgotten"
      : 2 * ended > breaks ? "connections_ended"
                           : "link_breaks";
  add(id, who,
      fmt::format("{} breaks in 10 min", breaks) + (last.empty() ? "" : ", the last: " + last) +
          (is_impatient
               ? fmt::format("; `dead_after` is {:.2g} s here, which is shorter than usual "
                             "silences: raise it",
                             facts_.dead_after)
               : "") +
          (id == "connections_ended" && is_of_one_age
               ? fmt::format("; each connection lasted about {:.0f} s", age)
               : ""),
      true);
  return true;
}

void Doctor::path(const Json& link, const std::string& who) {
  const double queue_ms = std::max(number_in(link, "path_queue_ms"),
                                   number_in(part_of(link, "lately"), "path_queue_ms"));
  if (queue_ms >= kQueueMsWorthTelling)
    add("path_full", who, fmt::format("{:.1f} s", queue_ms / 1e3));
  else if (const double round_trip = number_in(part_of(link, "clock"), "round_trip_ms");
           round_trip >= kRoundTripMs)
    add("path_slow", who, fmt::format("a round trip takes {:.1f} s", round_trip / 1e3));
  const double segments = lately_in(link, "segments"), again = lately_in(link, "retransmitted");
  if (segments >= kSegments && again >= kDroppedShare * segments)
    add("path_loses", who,
        fmt::format("{:.0f} % of {:.0f} TCP segments were sent again", 100 * again / segments,
                    segments));
  if (number_in(link, "unheard_seconds") >= kUnheard && number_in(link, "unacknowledged_bytes") > 0)
    add("path_silent", who, fmt::format("for {:.0f} s", number_in(link, "unheard_seconds")), true);
  const Json& clock = part_of(link, "clock");
  const double apart = std::abs(number_in(clock, "offset_ms")) - number_in(clock, "error_bound_ms");
  if (apart >= kClockApartMs)
    add("clocks_apart", who,
        fmt::format("the peer's is {} by {:.1f} s",
                    number_in(clock, "offset_ms") > 0 ? "ahead" : "behind",
                    std::abs(number_in(clock, "offset_ms")) / 1e3));
}

void Doctor::link(const Json& link) {
  const std::string who =
      fmt::format("link {:.0f} to {}", number_in(link, "link"), text_in(link, "node"));
  const bool is_broken = breaks(link, who);
  if (!is_set(link, "open")) return;
  if (is_set(link, "same_graph")) return add("one_graph", who, {}, true);
  if (is_set(link, "two_of_a_kind"))
    add("robot_word", who, is_robot_ ? "both are the robot" : "none is the robot", true);
  path(link, who);
  peer_findings(link, who);
  missing(link);
  if (!is_broken) thin(link);  // a path that breaks carries less than it could
  halting_.clear();
  for (const Json& one : part_of(link, "topics"))
    if (!is_exported(one) && driving::command_type(text_in(one, "type")))
      halting_.insert(text_in(one, "rule"));
  bool exports = false;
  bool is_heard = false;  // a node here subscribes to a topic of the peer: the graph is right
  for (const Json& one : part_of(link, "topics")) {
    topic(link, one);
    exports = exports || is_exported(one);
    is_heard = is_heard || (!is_exported(one) && is_set(one, "demanded"));
  }
  for (const Json& one : part_of(link, "services")) {
    service(one);
    exports = exports || is_exported(one);
  }
  for (const Json& name : part_of(link, "missing")) (is_exported(name) ? exports : is_heard) = true;
  silent_topics(link);
  // Who only looks has nothing to give.
  if (!exports && !is_heard && is_robot_ && facts_.may_export &&
      number_in(link, "open_seconds") >= kOpenSeconds)
    add("nothing_here", who);
}

// The other end sees why something does not arrive, and somebody here waits for it.
void Doctor::peer_findings(const Json& link, const std::string& who) {
  for (const Json& one : part_of(link, "peer_findings")) {
    const Finding* const known = finding_of(text_in(one, "id"));
    if (!known || !is_for_peers(known->id)) continue;
    found_.push_back(
        {known->id, text_in(one, "name"), kItsWords, true, "the other end of " + who, true});
  }
}

// "::1" of "[::1]:9090"
std::string plain_host_of(const std::string& address) {
  const std::string host = host_of(address);
  return host.starts_with('[') ? host.substr(1, host.size() - 2) : host;
}

Cause cause_in(const Json& part) {
  const std::string code = text_in(part, "last_failure_code");
  return code.empty() ? Cause::kNone : value_of(kCauseWords, code).value_or(Cause::kOther);
}

bool listens_on_loopback_alone(const Json& status) {
  const Json& addresses = part_of(status, "listens");
  return !addresses.empty() && std::all_of(addresses.begin(), addresses.end(), [](const Json& one) {
    return one.is_string() && syntax::is_loopback(plain_host_of(one.get<std::string>()));
  });
}

// "/connect_client was, until 2026-11-29T12:00:00Z: nothing heard from the peer", or nothing.
std::string last_lost(const Json& status) {
  std::string latest, text;
  for (const Json& link : part_of(status, "links")) {
    const Json& breaks = part_of(link, "breaks");
    if (breaks.empty() || text_in(breaks.back(), "lost") < latest) continue;
    latest = text_in(breaks.back(), "lost");
    text = fmt::format("{} was, until {}: {}", text_in(link, "node"), latest,
                       text_in(breaks.back(), "reason"));
  }
  return text;
}

// Why nobody is linked.
void Doctor::way(const Json& status) {
  if (is_client_) {
    const std::string text = text_in(status, "last_failure");
    const Cause cause = cause_in(status);
    return cause == Cause::kNone ? add("not_linked", {}, text, true)
                                 : add(finding_for(cause), {}, text, true);
  }
  const Json& strangers = part_of(status, "strangers");
  const std::string refused = number_in(part_of(status, "lately"), "refused") > 0
                                  ? text_in(strangers, "last_refused")
                                  : std::string();
  const bool is_reached =
      !refused.empty() && !syntax::is_loopback(refused.substr(0, refused.find(": ")));
  const std::string lost = last_lost(status);
  const bool is_local = part_of(status, "relays").empty() && listens_on_loopback_alone(status) &&
                        !is_reached && lost.empty();
  if (number_in(strangers, "proxy_headers") > 0)
    add("proxy_header_unexpected", {},
        fmt::format("{:.0f} connections", number_in(strangers, "proxy_headers")));
  if (const double logins = number_in(part_of(status, "lately"), "logins_not_judged"); logins > 0)
    add("login_not_judged", {}, fmt::format("{:.0f} logins", logins), true);
  if (is_local) add("loopback_alone");
  if (!refused.empty()) add("clients_refused", {}, "the last one came from " + refused);
  if (!is_local && refused.empty()) add("nobody_linked", {}, lost);
}

// Also while clients are linked that come by another way.
void Doctor::relays(const Json& status) {
  for (const Json& relay : part_of(status, "relays"))
    if (const Cause cause = cause_in(relay); !is_set(relay, "connected") && cause != Cause::kNone)
      add(finding_at_relay(cause), text_in(relay, "relay"), text_in(relay, "last_failure"), true);
}

void Doctor::resources(const Json& status) {
  const Json& lately = part_of(status, "lately");
  const double times = number_in(lately, "held_up");
  const double now_ms = number_in(status, "loop_lag_ms");
  const double most_ms = number_in(lately, "loop_lag_ms");
  const bool counts = times >= kTimesHeldUp || most_ms >= kHeldUpOnceMs;
  const double lag = counts ? std::max(now_ms, most_ms) : now_ms;
  if (lag >= kLagMsWorthTelling)
    add("loop_slow", {},
        fmt::format("for {:.0f} ms", lag) +
            (times > 1 ? fmt::format(" at most, {:.0f} times in the last minutes", times) : ""));
  const double used = std::max(number_in(status, "memory_max_used_bytes"),
                               number_in(lately, "memory_max_used_bytes"));
  if (used > 0 && used >= kMemoryShareWorthTelling * number_in(status, "memory_max_bytes"))
    add("memory_full", {}, fmt::format("{:.0f} MB", used / 1e6));
  if (const std::string problem = text_in(part_of(status, "audit"), "problem"); !problem.empty())
    add("audit_fails", {}, problem);
  if (const Json& refused = part_of(status, "refused_parameters"); !refused.empty())
    add("parameters_refused", {}, text_in(refused, "time") + ": " + text_in(refused, "problem"));
  for (const Json& refused : part_of(status, "refused_files"))
    add("file_refused", {}, text_in(refused, "reason"), true);
  if (const std::string problem = text_in(status, "status_file_problem"); !problem.empty())
    add("file_unwritable", "status_file", problem);
  for (const Json& key : part_of(status, "needs_restart"))
    if (key.is_string()) add("needs_restart", to_text(key.get<std::string>(), kKeyBytes), {}, true);
  certificate(status);
}

void Doctor::certificate(const Json& status) {
  const auto end = moment_in(status, "certificate_valid_until");
  if (!end || !now_) return;
  const std::string until = text_in(status, "certificate_valid_until");
  constexpr double kDaySeconds = 86'400;
  if (*end <= *now_)
    add("certificate_expired", {}, "on " + until);
  else if (*end - *now_ < kCertificateDaysWorthTelling * kDaySeconds)
    add("certificate_ends_soon", {}, "on " + until);
}

// Robots that come to an operator have identities of their own: two with one name are one robot's
// copy.
void Doctor::identities(const Json& links) {
  if (is_client_ || is_robot_) return;
  std::map<std::pair<std::string, std::string>, std::size_t> count;
  for (const Json& link : links)
    if (is_set(link, "open") && !text_in(link, "identity").empty())
      ++count[{text_in(link, "identity"), text_in(link, "node")}];
  for (const auto& [who, links_of] : count)
    if (links_of > 1)
      add("identity_twice", who.first, fmt::format("{} links of {}", links_of, who.second), true);
}

// A program that was killed leaves a link that waits for it, and returns as a new one. Of operators
// who went away no link returns; a program that says goodbye, or comes back by itself, leaves none.
void Doctor::restarts(const Json& links) {
  struct Seen {
    std::size_t lost = 0;
    std::optional<double> last;  // when one was lost
    std::string reason;
    double newest = 0;  // the number of the newest link that is open
    double newest_lost = 0;
  };
  std::map<ProgramOfLink, Seen> programs;
  for (const Json& link : links) {
    Seen& seen = programs[program_of(link)];
    const double number = number_in(link, "link");
    if (is_set(link, "open")) {
      seen.newest = std::max(seen.newest, number);
      continue;
    }
    const Json& breaks = part_of(link, "breaks");
    if (breaks.empty()) continue;
    const Json& last = breaks.back();
    const std::string code = text_in(last, "code");
    const auto since = moment_in(last, "lost");
    const bool is_orderly = code == "going_away" || code == "normal" || code == "replaced";
    if (is_orderly || !since || !now_ || *now_ - *since > kBreaksSeconds) continue;
    ++seen.lost;
    if (!seen.last || *since >= *seen.last) seen.reason = text_in(last, "reason");
    seen.last = std::max(seen.last.value_or(*since), *since);
    seen.newest_lost = std::max(seen.newest_lost, number);
  }
  for (const auto& [program, seen] : programs)
    if (seen.lost >= kBreaks && seen.newest > seen.newest_lost)
      add("program_restarts", program.name(),
          fmt::format("{} of its links were lost in 10 min{}{}", seen.lost,
                      seen.reason.empty() ? "" : ", the last: ", seen.reason),
          true);
}

void Doctor::know(const Json& status) {
  is_client_ = text_in(status, "role") == "client";
  node_ = text_in(status, "node");
  prefix_ = text_in(status, "prefix");
  is_robot_ = status.contains("is_robot") ? is_set(status, "is_robot") : !is_client_;
  now_ = moment_in(status, "time");
  carries_ = carries_data(status);
}

std::map<LinkId, std::vector<PeerFinding>> Doctor::for_peers(const Json& status) {
  know(status);
  std::map<LinkId, std::vector<PeerFinding>> all;
  for (const Json& one : part_of(status, "links")) {
    if (!is_set(one, "open")) continue;
    found_.clear();
    resources(status);
    link(one);
    auto& told = all[LinkId{static_cast<std::uint64_t>(number_in(one, "link"))}];
    for (const Found& found : found_)
      if (is_for_peers(found.id) && found.program.empty())
        told.push_back({std::string(found.id),
                        found.subject.starts_with('/') ? found.subject : std::string()});
  }
  return all;
}

void Doctor::side(const Json& status) {
  know(status);
  const Json& links = part_of(status, "links");
  const bool open = std::any_of(links.begin(), links.end(),
                                [](const Json& link) { return is_set(link, "open"); });
  relays(status);
  const bool by_relay =
      std::any_of(found_.begin(), found_.end(), [](const Found& one) { return one.waits; });
  if (!open && !by_relay) way(status);
  const double wrong = status.contains("lately")
                           ? number_in(part_of(status, "lately"), "wrong_logins")
                           : number_in(part_of(status, "strangers"), "wrong_logins");
  if (!is_client_ && wrong > 0) {
    const std::string last = text_in(part_of(status, "strangers"), "last_wrong_login");
    add("wrong_logins", {},
        fmt::format("{:.0f} times", wrong) + (last.empty() ? "" : ", the last: " + last));
    for (const std::string& name : facts_.expired) add("token_expired", name);
  }
  resources(status);
  identities(links);
  restarts(links);
  for (const Json& one : links) link(one);
}

void Doctor::relay(const Json& status) {
  know(status);
  certificate(status);
  const Json& robots = part_of(status, "robots");
  const auto is_here = [](const Json& robot) { return is_set(robot, "open"); };
  for (const Json& robot : robots)
    if (is_set(robot, "token_in_use"))
      add("robots_with_one_token", text_in(robot, "robot"), {}, true);
  if (!robots.empty() && std::none_of(robots.begin(), robots.end(), is_here)) add("no_robot_here");
}

}  // namespace

std::vector<Found> diagnose_status(const Json& status, const SideFacts& facts) {
  Doctor doctor(facts);
  text_in(status, "role") == "relay" ? doctor.relay(status) : doctor.side(status);
  return doctor.take();
}

SideFacts facts_of(const Config& config) {
  const auto& rules = config.policy.rules();
  const auto exports = [](const Rule& rule) {
    const auto& opened = rule.opens[Direction::kExport].values;
    return std::any_of(opened.begin(), opened.end(), [](const auto& of) { return !of.empty(); });
  };
  SideFacts facts{std::any_of(rules.begin(), rules.end(), exports),
                  config.limits.bytes_per_second_max};
  const std::uint64_t of_link = config.limits.outbox.bytes_per_second_max;
  if (of_link > 0 && (facts.bytes_per_second == 0 || of_link < facts.bytes_per_second)) {
    facts.bytes_per_second = of_link;
    facts.limit_key = "link.bytes_per_second";
  }
  facts.dead_after = std::chrono::duration<double>(config.limits.dead_after).count();
  for (const Rule& rule : rules) {
    const Treatment& how = rule.treatment;
    facts.rules[rule.name] = {
        how.max_age == kForever ? 0 : std::chrono::duration<double>(how.max_age).count(),
        how.priority == Priority::kUrgent, how.bytes_per_second_max > 0 && how.max_rate == 0,
        how.halt_after != kForever, how.lossy == Lossy::kNever};
    for (const Direction direction : {Direction::kExport, Direction::kImport})
      for (const OpenedBy kind : {OpenedBy::kTopics, OpenedBy::kServices, OpenedBy::kActions})
        for (const Pattern& pattern : rule.opens[direction][kind])
          facts.names.push_back({rule.name, right_key(direction, kind), direction, kind, pattern});
  }
  return facts;
}

std::map<LinkId, std::vector<PeerFinding>> findings_for_peers(const Json& status,
                                                              const SideFacts& facts) {
  return Doctor(facts).for_peers(status);
}

std::set<std::string> brought_topics(const Json& status) {
  std::set<std::string> names;
  for (const Json& link : part_of(status, "links"))
    for (const Json& topic : part_of(link, "topics"))
      if (!is_exported(topic) && lately_in(topic, "messages") > 0)
        names.insert(text_in(topic, "topic"));
  return names;
}

bool carries_data(const Json& status) {
  for (const Json& link : part_of(status, "links")) {
    for (const Json& topic : part_of(link, "topics"))
      if (number_in(topic, "messages") > 0) return true;
    for (const Json& service : part_of(link, "services"))
      if (number_in(service, "answered") > 0) return true;
  }
  return false;
}

}  // namespace connect_bridge
