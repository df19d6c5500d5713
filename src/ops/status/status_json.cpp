#include "ops/status/status_json.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/json.hpp"
#include "core/policy/treatment.hpp"
#include "ops/audit/audit_json.hpp"

namespace connect_bridge {
namespace {

std::string rfc3339_of(Stamp time) {
  return rfc3339(std::chrono::system_clock::time_point(
      std::chrono::duration_cast<std::chrono::system_clock::duration>(Duration(time))));
}

OrderedJson to_value(const Traffic& traffic) {
  return {{"sent_bytes", traffic.sent}, {"received_bytes", traffic.received}};
}

OrderedJson to_value(const StrangersStatus& strangers, const DoorCounts& doors) {
  return {{"accepted", doors.accepted},
          {"refused", doors.refused},
          {"waiting", strangers.waiting},
          {"gave_way", doors.gave_way + strangers.gave_way},
          {"handshakes_waited", doors.handshakes_waited},
          {"handshakes_dropped", doors.handshakes_dropped},
          {"wrong_logins", strangers.wrong_logins},
          {"wrong_logins_late", strangers.wrong_logins_late},
          {"shut_out", strangers.shut_out},
          {"login_timeouts", strangers.login_timeouts},
          {"logins_without_place", strangers.logins_without_place},
          {"logins_not_judged", strangers.logins_not_judged}};
}

OrderedJson to_value(const DropCounts& counts) {
  OrderedJson dropped = OrderedJson::object();
  for (std::size_t i = 0; i < kDropReasons; ++i)
    if (counts.by_reason[i] > 0)
      dropped[std::string(name_of(static_cast<DropReason>(i)))] = counts.by_reason[i];
  return dropped;
}

OrderedJson to_value(const TopicStatus& topic) {
  const OrderedJson dropped = to_value(topic.dropped);
  OrderedJson json = {{"topic", topic.topic},
                      {"type", topic.type},
                      {"direction", topic.exported ? "export" : "import"},
                      {"demanded", topic.demanded},
                      {"origins", topic.origins},
                      {"messages", topic.messages},
                      {"bytes", topic.bytes},
                      {"wire_bytes", topic.wire_bytes},
                      {"queued", topic.queued},
                      {"dropped", dropped}};
  if (topic.exported) {
    json["keep"] = word_of(kKeepWords, topic.keep);
    json["keep_because"] = topic.keep_because;
  }
  if (!topic.rule.empty()) json["rule"] = topic.rule;
  if (!topic.misfit.empty()) json["misfit"] = topic.misfit;
  if (topic.latency_ms) json["latency_ms"] = *topic.latency_ms;
  if (topic.published_for_each_sent > 1)
    json["overload"] = fmt::format("more than the link carries: one of {:.1f} is sent",
                                   topic.published_for_each_sent);
  if (!topic.declined.empty()) json["declined"] = topic.declined;
  if (!topic.declined_code.empty()) json["declined_code"] = topic.declined_code;
  return json;
}

OrderedJson to_value(const ServiceStatus& service) {
  OrderedJson json = {{"service", service.service},
                      {"type", service.type},
                      {"direction", service.exported ? "export" : "import"},
                      {"attached", service.attached},
                      {"pending", service.pending},
                      {"waiting", service.waiting},
                      {"calls", service.calls},
                      {"answered", service.answered},
                      {"refused", service.refused},
                      {"timed_out", service.timed_out},
                      {"forgotten", service.forgotten},
                      {"lost", service.lost},
                      {"duplicates", service.duplicates},
                      {"request_bytes", service.request_bytes},
                      {"response_bytes", service.response_bytes}};
  if (!service.rule.empty()) json["rule"] = service.rule;
  if (!service.declined.empty()) json["declined"] = service.declined;
  if (!service.declined_code.empty()) json["declined_code"] = service.declined_code;
  return json;
}

OrderedJson to_value(const MissingName& missing) {
  OrderedJson json = {{"kind", word_of(kKindWords, missing.kind)},
                      {"name", missing.name},
                      {"type", missing.type},
                      {"direction", missing.exported ? "export" : "import"},
                      {"reason", word_of(kMissingWords, missing.reason)},
                      {"text", missing.text}};
  if (!missing.rule.empty()) json["rule"] = missing.rule;
  if (!missing.code.empty()) json["code"] = missing.code;
  return json;
}

}  // namespace

void LinkPlaces::follow(const std::vector<LinkStatus>& links) {
  const auto has = [](const auto& all, const auto& is) {
    return std::any_of(all.begin(), all.end(), is);
  };
  for (auto& place : places_)
    if (!has(links, [&](const LinkStatus& link) { return link.number == place; })) place = 0;
  for (const LinkStatus& link : links) {
    if (has(places_, [&](std::uint64_t place) { return place == link.number; })) continue;
    auto free = std::find(places_.begin(), places_.end(), 0U);
    if (free == places_.end()) free = places_.insert(free, 0);
    *free = link.number;
  }
}

std::size_t LinkPlaces::of(const LinkStatus& link) const {
  const auto place = std::find(places_.begin(), places_.end(), link.number);
  return static_cast<std::size_t>(place - places_.begin()) + 1;
}

OrderedJson facts_of(const LinkStatus& link, Names names) {
  OrderedJson json = {
      {"link", link.number},
      {"peer", link.peer},
      {"node", link.node},
      {"identity", names == Names::kShown ? link.identity : ""},
      {"open", link.open},
      {"open_seconds", std::chrono::floor<std::chrono::seconds>(link.open_for).count()},
      {"connects", link.connects},
      {"mirrors_waited", link.mirrors_waited},
      {"sent_bytes", link.sent_bytes},
      {"received_bytes", link.received_bytes},
      {"queued_bytes", link.queued_bytes},
      {"unacknowledged_bytes", link.unacknowledged_bytes},
      {"memory_bytes", link.memory_bytes},
      {"rate_bytes_per_second", static_cast<std::uint64_t>(link.rate)},
      {"path_queue_ms", milliseconds_of(link.path_queue)}};
  if (link.clock.known)
    json["clock"] = {{"offset_ms", milliseconds_of(link.clock.offset)},
                     {"round_trip_ms", milliseconds_of(link.clock.round_trip)},
                     {"error_bound_ms", milliseconds_of(link.clock.error_bound)}};
  if (link.login_end != 0) json["login_valid_until"] = rfc3339_of(link.login_end);
  return json;
}

namespace {

OrderedJson to_value(const LinkStatus& link, Names names) {
  OrderedJson json = facts_of(link, names);
  json["topics"] = OrderedJson::array();
  for (const auto& topic : link.topics) json["topics"].push_back(to_value(topic));
  json["services"] = OrderedJson::array();
  for (const auto& service : link.services) json["services"].push_back(to_value(service));
  json["missing"] = OrderedJson::array();
  for (const auto& missing : link.missing) json["missing"].push_back(to_value(missing));
  if (link.further_missing > 0) json["further_missing"] = {{"count", link.further_missing}};
  if (link.further_topics > 0)
    json["further_topics"] = {
        {"count", link.further_topics},  {"messages", link.further.messages},
        {"bytes", link.further.bytes},   {"wire_bytes", link.further.wire_bytes},
        {"queued", link.further.queued}, {"dropped", to_value(link.further.dropped)}};
  if (link.further_services > 0) json["further_services"] = {{"count", link.further_services}};
  return json;
}

}  // namespace

OrderedJson facts_of(const StatusPicture& picture, Names names) {
  const Status& status = picture.side;
  const RunStatus& run = picture.run;
  // That of a client is about its server.
  const bool shows_failure = names == Names::kShown || run.role == Role::kClient;
  OrderedJson json = {{"schema", kStatusSchema},
                      {"time", run.time},
                      {"running", run.running},
                      {"started", run.started},
                      {"version", run.version},
                      {"node", run.node},
                      {"role", run.role == Role::kServer ? "server" : "client"},
                      {"loop_lag_ms", run.loop_lag_ms},
                      {"memory_bytes", status.memory_bytes},
                      {"memory_max_used_bytes", status.shared_bytes},
                      {"memory_max_bytes", status.shared_bytes_max},
                      {"taken", run.ros.taken},
                      {"published", run.ros.published},
                      {"traffic", to_value(run.traffic)},
                      {"types_not_installed", run.ros.types_not_installed},
                      {"reading_held", run.network.held},
                      {"extra_frames", run.network.extra_frames},
                      {"last_failure", shows_failure ? status.last_failure.text : ""},
                      {"last_failure_code", word_of(status.last_failure.cause)}};
  if (run.certificate_end != 0) json["certificate_valid_until"] = rfc3339_of(run.certificate_end);
  if (run.audit) {
    json["audit"] = {{"lines", run.audit->lines}, {"left_out", run.audit->left_out}};
    if (!run.audit->problem.empty()) json["audit"]["problem"] = run.audit->problem;
  }
  if (!run.listens.empty()) json["listens"] = run.listens;
  if (run.relay)
    json["relay"] = {{"connected", run.relay->connected},
                     {"last_failure", run.relay->failure.text},
                     {"last_failure_code", word_of(run.relay->failure.cause)}};
  if (run.role == Role::kServer) json["strangers"] = to_value(status.strangers, run.network);
  return json;
}

std::string to_json(const StatusPicture& picture, Names names, bool in_lines) {
  OrderedJson json = facts_of(picture, names);
  json["links"] = OrderedJson::array();
  for (const auto& link : picture.side.links) json["links"].push_back(to_value(link, names));
  return json.dump(in_lines ? 1 : -1, ' ', false, OrderedJson::error_handler_t::replace);
}

}  // namespace connect_bridge
