#include "ops/status/metrics.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "core/base/metrics_text.hpp"

namespace connect_bridge {
namespace {

// Everything that is counted or measured for a topic, a service or a link.
constexpr MetricHelp kCounters[] = {
    {"topic_messages", "Messages sent to peers (export) or published here (import)"},
    {"topic_bytes", "Their bytes, before compression"},
    {"topic_wire_bytes", "Their bytes on the connection"},
    {"topic_dropped", "Messages that were not delivered, by reason"},
    {"service_calls", "Calls that were begun"},
    {"service_calls_ended", "Calls that have ended, by how"},
};
constexpr MetricHelp kLinkCounters[] = {
    {"link_sent_bytes", "Bytes sent on the connection of a link"},
    {"link_received_bytes", "Bytes received on it"},
    {"link_connects", "Times that the link was connected"},
};
constexpr MetricHelp kGauges[] = {
    {"topic_age_seconds", "Age of the last message at its publication here, the most of all links"},
    {"topic_queued", "Messages that wait to be sent"},
    {"service_calls_under_way", "Calls without an answer"},
    {"link_open", "Whether a link is connected"},
    {"link_round_trip_seconds", "Round trip of the path, without its queue"},
    {"link_path_queue_seconds", "How long packets wait on the path"},
    {"link_rate_bytes_per_second", "What the path carries"},
    {"link_queued_bytes", "Bytes that wait to be sent"},
    {"link_unacknowledged_bytes", "Bytes that were sent and not yet acknowledged"},
    {"link_memory_bytes", "Memory that is held because of the peer"},
};

double in_seconds(Duration time) {
  return std::chrono::duration<double>(time).count();
}

}  // namespace

void Metrics::count(const StatusPicture& picture) {
  last_ = picture;
  now_.clear();
  of_links_.clear();
  for (const LinkStatus& link : picture.side.links) {
    add_link(picture.places.of(link), link);
    for (const auto& topic : link.topics) add_topic(link, topic);
    for (const auto& service : link.services) add_service(link, service);
  }
  before_ = std::exchange(next_, {});
}

std::string Metrics::labels_of(const std::string& kind, const std::string& name, bool exported) {
  const std::string direction = metric_label("direction", exported ? "export" : "import") + ",";
  const std::string labels = direction + metric_label(kind, name);
  if (names_.contains(labels)) return labels;
  if (names_.size() >= kNamesMax) return direction + metric_label(kind, "other");
  return *names_.insert(labels).first;
}

void Metrics::add(const LinkStatus& link, const std::string& own, const std::string& metric,
                  const std::string& labels, std::uint64_t total) {
  if (total == 0) return;
  const std::tuple key{link.number, metric, own};
  const auto before = before_.find(key);
  const std::uint64_t had = before == before_.end() ? 0 : before->second;
  // Less than before: it was withdrawn and offered again.
  totals_[metric][labels] += total >= had ? total - had : total;
  next_[key] = total;
}

void Metrics::add_topic(const LinkStatus& link, const TopicStatus& topic) {
  const std::string labels = labels_of("topic", topic.topic, topic.exported);
  const std::string own = (topic.exported ? ">" : "<") + topic.topic + " " + topic.type;
  add(link, own, "topic_messages", labels, topic.messages);
  add(link, own, "topic_bytes", labels, topic.bytes);
  add(link, own, "topic_wire_bytes", labels, topic.wire_bytes);
  for (std::size_t i = 0; i < kDropReasons; ++i) {
    const std::string reason = "," + metric_label("reason", name_of(static_cast<DropReason>(i)));
    add(link, own + reason, "topic_dropped", labels + reason, topic.dropped.by_reason[i]);
  }
  if (topic.exported) now_["topic_queued"][labels] += static_cast<double>(topic.queued);
  if (!topic.latency_ms) return;
  double& age =
      now_["topic_age_seconds"].try_emplace(labels, *topic.latency_ms / 1e3).first->second;
  age = std::max(age, *topic.latency_ms / 1e3);
}

void Metrics::add_service(const LinkStatus& link, const ServiceStatus& service) {
  const std::string labels = labels_of("service", service.service, service.exported);
  const std::string own = (service.exported ? ">" : "<") + service.service + " " + service.type;
  add(link, own, "service_calls", labels, service.calls);
  for (const auto& [how, count] : {std::pair{"answered", service.answered},
                                   {"refused", service.refused},
                                   {"timed_out", service.timed_out},
                                   {"forgotten", service.forgotten},
                                   {"lost", service.lost}})
    add(link, own + how, "service_calls_ended", labels + "," + metric_label("how", how), count);
  now_["service_calls_under_way"][labels] += service.pending;
}

void Metrics::add_link(std::size_t place, const LinkStatus& link) {
  const std::string labels = metric_label("link", std::to_string(place));
  of_links_["link_sent_bytes"][labels] = link.sent_bytes;
  of_links_["link_received_bytes"][labels] = link.received_bytes;
  of_links_["link_connects"][labels] = link.connects;
  now_["link_open"][labels] = link.open ? 1 : 0;
  if (link.clock.known) now_["link_round_trip_seconds"][labels] = in_seconds(link.clock.round_trip);
  now_["link_path_queue_seconds"][labels] = in_seconds(link.path_queue);
  now_["link_rate_bytes_per_second"][labels] = link.rate;
  now_["link_queued_bytes"][labels] = static_cast<double>(link.queued_bytes);
  now_["link_unacknowledged_bytes"][labels] = static_cast<double>(link.unacknowledged_bytes);
  now_["link_memory_bytes"][labels] = static_cast<double>(link.memory_bytes);
}

std::string Metrics::text(bool open) const {
  const Status& side = last_.side;
  const RunStatus& run = last_.run;
  MetricsText text(open);
  const bool server = run.role == Role::kServer;
  text.family("build", false, "The program that runs");
  text.sample(1, metric_label("version", run.version) + "," +
                     metric_label("role", server ? "server" : "client") + "," +
                     metric_label("node", run.node));
  text.one("loop_lag_seconds", false, "Longest delay of the loop in the last second",
           run.loop_lag_ms / 1e3);
  text.one("memory_bytes", false, "Memory that peers use, of memory_max", side.shared_bytes);
  text.one("memory_max_bytes", false, "memory_max", side.shared_bytes_max);
  text.one("taken", true, "Messages taken from the local graph", run.ros.taken);
  text.one("published", true, "Messages published in the local graph", run.ros.published);
  text.one("sent_bytes", true, "Bytes of IP packets sent", run.traffic.sent);
  text.one("received_bytes", true, "Bytes of IP packets received", run.traffic.received);
  text.one("reading_held", true, "Times that reading waited since a peer sent more than it may",
           run.network.held);
  if (run.certificate_end != 0)
    text.one("certificate_end_time_seconds", false, "When the certificate in use ends",
             run.certificate_end / kStampSecond);
  if (run.audit) {
    text.one("audit_lines", true, "Lines written to the audit log", run.audit->lines);
    text.one("audit_left_out", true, "Lines that were not", run.audit->left_out);
  }
  if (server) {
    text.one("connections_refused", true, "Connections refused before a login",
             run.network.refused);
    text.one("wrong_logins", true, "Wrong logins", side.strangers.wrong_logins);
    text.one("login_timeouts", true, "Connections without a login in time",
             side.strangers.login_timeouts);
  }
  text.one("links", false, "Links, those that are lost and may return among them",
           side.links.size());
  for (const auto& metric : kLinkCounters) text.all_of(metric, true, of_links_);
  for (const auto& metric : kCounters) text.all_of(metric, true, totals_);
  for (const auto& metric : kGauges) text.all_of(metric, false, now_);
  return text.take();
}

}  // namespace connect_bridge
