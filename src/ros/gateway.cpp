#include "ros/gateway.hpp"

#include <map>
#include <tuple>
#include <utility>

#include "ros/rcl/middleware.hpp"
#include "ros/rcl/publisher_ids.hpp"

namespace connect_bridge::ros {

Gateway::Gateway(Node& node, const GatewayOptions& options, std::function<void()> wake)
    : options_(options),
      shared_(
          node, options.message_bytes_max, options.types_not_installed, std::move(wake),
          [this](const std::string& name) { return graph_.has_node(name); },
          [this](Duration delay) { graph_.look_again(delay); }),
      graph_(node, shared_.ready, options.graph_pause, [this](bool changed) {
        if (changed) shared_.node.publisher_ids().refresh();
        services_.look_at_graph(changed);
      }) {
  if (!middleware().tells_origins())
    node.log(LogLevel::kWarn,
             "Cyclone DDS does not show here which publisher sent a sample: where a topic has "
             "several publishers, the other side gets samples of one under the name of another");
}

bool Gateway::drain(const std::function<void(Input&&)>& sink) {
  shared_.ready.collect();
  services_.watch_servers();
  const bool checked = publish_checked();
  auto& reports = shared_.reports;
  for (std::size_t n = reports.size(); n > 0; --n) {
    Input input = std::move(reports.front());
    reports.pop_front();
    sink(std::move(input));
  }
  Batch batch;
  while (!shared_.ready.idle() && batch.steps < options_.steps_per_wake_max &&
         batch.bytes < options_.bytes_per_wake_max) {
    auto input = shared_.ready.step(batch);
    if (!input) continue;
    // The subscription could not be opened again; the core treats it as destroyed.
    const auto* failed = std::get_if<SubscriptionFailed>(&*input);
    if (failed != nullptr) subscriptions_.destroy(failed->id);
    if (auto* graph = std::get_if<GraphChanged>(&*input)) add_lacks(*graph);
    sink(std::move(*input));
  }
  const bool ending = shared_.ended.free_some();
  if (const auto leave = shared_.ended.next_leave())
    shared_.look_again(*leave - std::chrono::steady_clock::now());
  const bool looking = services_.look_at_some();
  const bool more = checked || ending || looking || !shared_.ready.idle() || !reports.empty();
  if (more) shared_.ready.wake();  // one wake includes inputs that arrive meanwhile
  return more;
}

bool Gateway::publish_checked() {
  for (int steps = 0; steps < options_.steps_per_wake_max; ++steps) {
    const auto sample = check_.take();
    if (!sample) return false;
    on_checked(*sample);
    if (sample->what.payload.size() > kLargeSample) return true;  // publishing it takes long
  }
  return true;
}

void Gateway::on_checked(const SampleCheck::Sample& sample) {
  if (auto* mirror = mirrors_.find(sample.what.mirror)) mirror->on_checked(sample);
}

void Gateway::add_lacks(GraphChanged& graph) {
  // Most types are used by many nodes, so each is looked up once.
  std::map<std::tuple<std::string, std::string, bool>, std::optional<TypeLack>> known;
  const auto lack_of = [&](const std::string& type, const std::string& hash, bool is_service) {
    const auto [at, is_new] = known.try_emplace({type, hash, is_service});
    if (is_new) at->second = shared_.types.lack_of(type, hash, is_service);
    return at->second;
  };
  std::map<std::string, bool> headers;
  for (TopicState& topic : graph.topics) {
    topic.lack = lack_of(topic.type, topic.type_hash, false);
    const auto [at, is_new] = headers.try_emplace(topic.type);
    if (is_new) at->second = shared_.types.has_header(topic.type);
    topic.has_header = at->second;
  }
  for (ServiceState& service : graph.services) service.lack = lack_of(service.type, "", true);
}

void Gateway::apply(const Publish& action) {
  auto* mirror = mirrors_.find(action.mirror);
  if (mirror == nullptr) return;
  if (mirror->is_checked_beside(action))
    while (const auto sample = check_.make_room(action.payload.size())) on_checked(*sample);
  mirror->publish(action, check_);
}

void Gateway::apply(const SendResponse& action) {
  auto* mirror = services_.mirrors.find(action.mirror);
  if (mirror != nullptr) mirror->respond(action.request, action.payload.view());
}

void Gateway::apply(const DropRequest& action) {
  if (auto* mirror = services_.mirrors.find(action.mirror))
    mirror->drop(action.request, action.aborted);
}

void Gateway::apply(const SendRequest& action) {
  auto* client = services_.clients.find(action.client);
  if (client != nullptr) client->send(action.invocation, action.payload.view());
}

void Gateway::apply(const DropInvocation& action) {
  if (auto* client = services_.clients.find(action.client)) client->drop(action.invocation);
}

std::string Gateway::open_diagnostics() {
  const auto refusal = diagnostics_.open();
  if (refusal) return refusal->reason;
  graph_.refresh(kDiagnosticsTopic);  // an earlier reading has left out our publisher
  return {};
}

GatewayCounters Gateway::counters() const {
  GatewayCounters counters = shared_.counters;
  counters.graph_readings = graph_.readings();
  counters.graph_reading = graph_.reading_time();
  counters.subscriptions = static_cast<std::uint32_t>(subscriptions_.size());
  counters.mirrors = static_cast<std::uint32_t>(mirrors_.size());
  counters.service_mirrors = static_cast<std::uint32_t>(services_.mirrors.size());
  counters.service_clients = static_cast<std::uint32_t>(services_.clients.size());
  counters.proxy_nodes = static_cast<std::uint32_t>(shared_.proxies.size());
  counters.types_not_installed =
      static_cast<std::uint32_t>(shared_.types.made()) - (diagnostics_.is_bare() ? 1 : 0);
  counters.pending_calls = static_cast<std::uint32_t>(services_.pending());
  return counters;
}

}  // namespace connect_bridge::ros
