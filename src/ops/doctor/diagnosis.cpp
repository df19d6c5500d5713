#include "ops/doctor/diagnosis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "config/syntax.hpp"
#include "core/wire/text.hpp"
#include "ops/doctor/worth_telling.hpp"
#include "ops/status/json_members.hpp"

namespace connect_bridge {
namespace {

constexpr std::size_t kTextBytes = 300;
constexpr std::size_t kOfOneKindMax = 8;  // findings with one id; further ones are not told
constexpr double kClockOffsetMs = 1000;
constexpr double kOpenSeconds = 10;  // until something may be expected of a link
constexpr double kBreaks = 10;       // in this time, at most
constexpr double kBreaksSeconds = 600;
constexpr double kDroppedShare = 0.05;
constexpr std::uint64_t kSharedMemoryBytes = 64ULL << 20;

// ---- causes

std::string_view finding_for(Cause cause) {
  switch (cause) {
    case Cause::kCertificateEarly: return "clock_or_certificate_early";
    case Cause::kOtherKey: return "certificate_pin";
    case Cause::kAddressGone: return "connection_lost";
    case Cause::kGoingAway: return "peer_stops";
    case Cause::kSilent: return "link_silent";
    case Cause::kSameSide: return "dialed_itself";
    case Cause::kExpired: return "login_expired";
    case Cause::kRevoked: return "login_withdrawn";
    case Cause::kValueWrong: return "file_wrong";
    case Cause::kNone:
    case Cause::kOther:
    case Cause::kClosed:
    case Cause::kNormal:
    case Cause::kMalformed:
    case Cause::kReplaced:
    case Cause::kTooLarge:
    case Cause::kSlowPeer:
    case Cause::kIllegal:
    case Cause::kUnknownChannel:
    case Cause::kInternal: return "link_fails";
    default: return word_of(cause);  // the finding has the word of the cause
  }
}

// ---- a status

// The finding that the importer's code of a declined channel means (docs/protocol.md, "decline").
std::string_view finding_of_decline(const std::string& code) {
  if (code == "type_unknown") return "type_not_installed";
  if (code == "type_mismatch") return "definitions_differ";
  if (code == "not_permitted") return "not_taken";
  return "declined";
}

// The finding of a missing name. Most reasons are findings.
std::string_view finding_of_missing(const std::string& reason, const std::string& code) {
  if (reason == "type_unknown") return "type_not_installed";
  if (reason == "lost") return "lost_in_middleware";
  if (reason == "declined") return finding_of_decline(code);
  const Finding* const same = finding_of(reason);
  return same ? same->id : "declined";
}

class Doctor {
 public:
  void side(const Json& status);
  void relay(const Json& status);
  std::vector<Found> take() { return std::move(found_); }

 private:
  void add(std::string_view id, std::string subject = {}, std::string detail = {});
  void way(const Json& status, bool is_client);
  void link(const Json& link, double running_seconds);
  void missing(const Json& link);
  void topic(const Json& link, const Json& topic);
  void thin(const Json& link);

  std::map<std::string_view, std::size_t> counts_;
  std::vector<Found> found_;
};

void Doctor::add(std::string_view id, std::string subject, std::string detail) {
  if (++counts_[id] <= kOfOneKindMax) found_.push_back({id, std::move(subject), std::move(detail)});
}

void Doctor::missing(const Json& link) {
  for (const Json& name : part_of(link, "missing")) {
    const auto finding = finding_of_missing(text_in(name, "reason"), text_in(name, "code"));
    add(finding, text_in(name, "name"), text_in(name, "text"));
  }
}

void Doctor::topic(const Json& link, const Json& topic) {
  const std::string name = text_in(topic, "topic");
  const bool exported = text_in(topic, "direction") == "export";
  const Json& dropped = part_of(topic, "dropped");
  const double messages = number_in(topic, "messages");
  const auto many = [&](const char* reason) {
    const double count = number_in(dropped, reason);
    return count > 0 && count >= kDroppedShare * (messages + count);
  };
  const auto counted = [&](const char* reason) {
    return fmt::format("{} {:.0f} of {:.0f}", reason, number_in(dropped, reason),
                       messages + number_in(dropped, reason));
  };
  if (many("rate")) add("drops_rate", name, counted("rate"));
  if (many("too_large")) add("drops_too_large", name, counted("too_large"));
  if (many("memory")) add("drops_memory", name, counted("memory"));
  if (many("max_age")) {
    const double offset = number_in(part_of(link, "clock"), "offset_ms");
    if (std::abs(offset) >= kClockOffsetMs)
      add("clocks_differ", name, fmt::format("by {:.1f} s", offset / 1e3));
    else
      add("drops_max_age", name, counted("max_age"));
  }
  if (!exported) return;
  const bool demanded = is_set(topic, "demanded");
  if (demanded && messages == 0 && number_in(topic, "origins") > 0 && dropped.empty() &&
      number_in(topic, "queued") == 0 && number_in(link, "open_seconds") >= kOpenSeconds)
    add("nothing_arrives", name);
  if (!demanded && text_in(topic, "declined").empty()) add("no_listener", name);
}

// The finding of a thin link names the heaviest of the topics that lose messages to it.
void Doctor::thin(const Json& link) {
  const Json* heaviest = nullptr;
  for (const Json& topic : part_of(link, "topics")) {
    const Json& dropped = part_of(topic, "dropped");
    const double lost = number_in(dropped, "newer_available") + number_in(dropped, "queue_time") +
                        number_in(dropped, "queue_bytes");
    if (lost == 0 || lost < kDroppedShare * (lost + number_in(topic, "messages"))) continue;
    if (!heaviest || number_in(topic, "wire_bytes") > number_in(*heaviest, "wire_bytes"))
      heaviest = &topic;
  }
  if (!heaviest) return;
  add("link_too_thin", text_in(*heaviest, "topic"),
      fmt::format("it is the heaviest: {:.1f} MB so far; the path carries {:.0f} kB/s",
                  number_in(*heaviest, "wire_bytes") / 1e6,
                  number_in(link, "rate_bytes_per_second") / 1e3));
}

void Doctor::link(const Json& link, double running_seconds) {
  const std::string who =
      fmt::format("link {:.0f} to {}", number_in(link, "link"), text_in(link, "node"));
  const double connects = number_in(link, "connects");
  if (connects > kBreaks && running_seconds < connects * kBreaksSeconds)
    add("link_breaks", who, fmt::format("connected {:.0f} times", connects));
  if (!is_set(link, "open")) return;
  if (number_in(link, "path_queue_ms") >= kQueueMsWorthTelling)
    add("path_full", who, fmt::format("{:.1f} s", number_in(link, "path_queue_ms") / 1e3));
  missing(link);
  thin(link);
  bool exports = false;
  for (const Json& one : part_of(link, "topics")) {
    topic(link, one);
    exports = exports || text_in(one, "direction") == "export";
  }
  for (const Json& service : part_of(link, "services"))
    exports = exports || text_in(service, "direction") == "export";
  for (const Json& name : part_of(link, "missing"))
    exports = exports || text_in(name, "direction") == "export";
  if (!exports && number_in(link, "open_seconds") >= kOpenSeconds) add("nothing_here", who);
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

// Why nobody is linked.
void Doctor::way(const Json& status, bool is_client) {
  if (is_client) {
    const std::string text = text_in(status, "last_failure");
    add("not_linked", {}, text);
    if (const Cause cause = cause_in(status); cause != Cause::kNone)
      add(finding_for(cause), {}, text);
    return;
  }
  const Json& relays = part_of(status, "relays");
  for (const Json& relay : relays)
    if (const Cause cause = cause_in(relay); !is_set(relay, "connected") && cause != Cause::kNone)
      return add(finding_for(cause), "listen.relay.url", text_in(relay, "last_failure"));
  const bool is_local = relays.empty() && listens_on_loopback_alone(status);
  add(is_local ? "loopback_alone" : "nobody_linked");
}

void Doctor::side(const Json& status) {
  const bool is_client = text_in(status, "role") == "client";
  const Json& links = part_of(status, "links");
  const bool open = std::any_of(links.begin(), links.end(),
                                [](const Json& link) { return is_set(link, "open"); });
  const auto now = moment_in(status, "time"), since = moment_in(status, "started");
  if (!open) way(status, is_client);
  if (const double wrong = number_in(part_of(status, "strangers"), "wrong_logins"); wrong > 0)
    add("wrong_logins", {}, fmt::format("{:.0f} times", wrong));
  if (const double lag = number_in(status, "loop_lag_ms"); lag >= kLagMsWorthTelling)
    add("loop_slow", {}, fmt::format("{:.0f} ms", lag));
  const double used = number_in(status, "memory_max_used_bytes");
  if (used > 0 && used >= kMemoryShareWorthTelling * number_in(status, "memory_max_bytes"))
    add("memory_full", {}, fmt::format("{:.0f} MB", used / 1e6));
  if (const std::string problem = text_in(part_of(status, "audit"), "problem"); !problem.empty())
    add("audit_fails", {}, problem);
  if (const auto end = moment_in(status, "certificate_valid_until"); end && now) {
    const std::string until = text_in(status, "certificate_valid_until");
    constexpr double kDay = 86'400;
    if (*end <= *now)
      add("certificate_expired", {}, "on " + until);
    else if (*end - *now < kCertificateDaysWorthTelling * kDay)
      add("certificate_ends_soon", {}, "on " + until);
  }
  for (const Json& one : links) link(one, now && since ? *now - *since : 0);
}

void Doctor::relay(const Json& status) {
  for (const Json& robot : part_of(status, "robots"))
    if (is_set(robot, "token_in_use")) add("robots_with_one_token", text_in(robot, "robot"));
}

std::string value_of(const ProcessFacts& process, const char* name, const char* otherwise) {
  const auto found = process.variables.find(name);
  return found == process.variables.end() || found->second.empty() ? otherwise : found->second;
}

}  // namespace

Found diagnose(const Failure& failure) {
  return {finding_for(failure.cause), {}, to_text(failure.text, kTextBytes)};
}

std::vector<Found> diagnose_config(const Config& config) {
  std::vector<Found> found;
  bool opens = false;
  for (const Rule& rule : config.policy.rules()) {
    for (const auto& in_direction : rule.opens.values)
      for (const auto& patterns : in_direction.values) opens = opens || !patterns.empty();
    if (rule.treatment.max_age == kForever) continue;
    for (const auto& in_direction : rule.opens.values)
      for (const Pattern& pattern : in_direction[OpenedBy::kTopics])
        for (const char* latched : {"/tf_static", "/map", "/robot_description"})
          if (pattern.text() == latched)
            found.push_back({"max_age_and_latched", rule.name, latched});
  }
  if (!opens) found.push_back({"rule_allows_nothing", {}, {}});
  return found;
}

std::vector<Found> diagnose_status(const Json& status) {
  Doctor doctor;
  text_in(status, "role") == "relay" ? doctor.relay(status) : doctor.side(status);
  return doctor.take();
}

std::vector<Found> diagnose_processes(const ProcessFacts& side, const ProcessFacts& shell) {
  std::vector<Found> found;
  const auto compare = [&](std::string_view id, const char* name, const char* otherwise) {
    const std::string there = value_of(side, name, otherwise);
    const std::string here = value_of(shell, name, otherwise);
    if (there != here)
      found.push_back({id, name,
                       fmt::format("{} there, {} here", to_text(there, kTextBytes),
                                   to_text(here, kTextBytes))});
  };
  compare("domain_differs", "ROS_DOMAIN_ID", "0");
  compare("rmw_differs", "RMW_IMPLEMENTATION", "rmw_fastrtps_cpp");
  compare("discovery_range", "ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET");
  compare("discovery_range", "ROS_LOCALHOST_ONLY", "0");
  for (const auto* process : {&side, &shell})
    if (value_of(*process, "ROS_AUTOMATIC_DISCOVERY_RANGE", "") == "OFF") {
      found.push_back({"discovery_range", "ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF: nobody is found"});
      break;
    }
  if (side.user != shell.user)
    found.push_back({"user_differs", {}, fmt::format("{} there, {} here", side.user, shell.user)});
  return found;
}

std::vector<Found> diagnose_machine(const MachineFacts& machine) {
  std::vector<Found> found;
  if (machine.shared_memory_free_bytes < kSharedMemoryBytes)
    found.push_back({"shared_memory_small", "/dev/shm",
                     fmt::format("{:.0f} MB are free",
                                 static_cast<double>(machine.shared_memory_free_bytes) / 1e6)});
  if (!machine.congestion_controls.empty() &&
      machine.congestion_controls.find("bbr") == std::string::npos)
    found.push_back({"no_bbr", {}, "allowed are " + machine.congestion_controls});
  return found;
}

}  // namespace connect_bridge
