#include "sim/small_world.hpp"

#include <utility>

#include "sim/label.hpp"

namespace connect_bridge::sim {

using namespace std::chrono_literals;

SmallWorld::SmallWorld(std::uint64_t seed, std::vector<GraphPlan> graphs, bool overlaps)
    : rng_(seed),
      middleware_(schedule_, std::move(graphs), rng_.fork(), *this),
      services_(schedule_, middleware_, rng_.fork(), *this),
      network_(schedule_, rng_.fork()),
      checker_(schedule_, middleware_, network_, overlaps) {}

Rule SmallWorld::everything() {
  Rule rule;
  rule.name = "all";
  rule.opens[Direction::kExport][OpenedBy::kTopics] = {std::move(Pattern::parse("/**")).value()};
  rule.opens[Direction::kImport][OpenedBy::kTopics] =
      rule.opens[Direction::kExport][OpenedBy::kServices] =
          rule.opens[Direction::kImport][OpenedBy::kServices] =
              rule.opens[Direction::kExport][OpenedBy::kTopics];
  return rule;
}

HostPlan SmallWorld::plan_of(Role role, int graph) {
  HostPlan plan;
  plan.graph = graph;
  plan.job_delay_max = 1ms;
  plan.options.role = role;
  plan.options.audits = true;
  plan.options.pictures = true;
  plan.options.dead_after = 3s;
  plan.options.retry_min = 100ms;
  plan.options.retry_max = 500ms;
  plan.options.ends_at_once = 2;  // links tell little here
  plan.options.offers_at_once = plan.options.offer_ends_at_once = 2;
  plan.options.listeners_at_once = 1;
  return plan;
}

void SmallWorld::build_host(const HostPlan& plan, bool verbose) {
  const Host::World around{schedule_, middleware_, services_, network_,
                           checker_,  accounts_,   digest_,   verbose};
  const int index = static_cast<int>(hosts_.size());
  hosts_.push_back(std::make_unique<Host>(index, plan, around, rng_.fork()));
  schedule_.after(plan.start, [&host = *hosts_.back()] { host.start(); });
}

int SmallWorld::build_path(int client, int server, const PathPlan& plan) {
  Host& from = *hosts_[static_cast<std::size_t>(client)];
  Host& to = *hosts_[static_cast<std::size_t>(server)];
  const int path = network_.add_path(from, to, plan);
  from.set_path(path);
  checker_.ledger().add_pair({&from, &to, path, {}, true});
  return path;
}

int SmallWorld::build_service(const std::string& name, const std::string& type, Duration takes) {
  answer_takes_ = takes;
  EndpointSpec spec;
  spec.topic = name;
  spec.type = type;
  spec.node_namespace = "/";
  spec.node_name = "worker";
  services_.create_servant(spec);
  spec.graph = 1;
  spec.node_name = "caller";
  return services_.create_caller(spec);
}

std::uint32_t SmallWorld::call(int caller) {
  checker_.calls().on_call(caller);
  const std::uint32_t number = checker_.calls().called(caller);
  const Label label{kCallerLabels + static_cast<std::uint32_t>(caller), number};
  services_.call({caller, number}, Payload::adopt(make_message(label, 64, false)));
  return number;
}

void SmallWorld::on_delivery(const Reader& reader, const Writer& writer, const Sample& sample) {
  if (reader.spec.host >= 0)
    return hosts_[static_cast<std::size_t>(reader.spec.host)]->on_sample(reader, writer, sample);
  checker_.on_delivery(reader, writer, sample);
  if (!is_ordinary(reader.spec.topic)) return;
  on_heard(reader, *read_label(sample.payload.view()));
}

void SmallWorld::on_graph_change(int graph) {
  for (auto& host : hosts_)
    if (host->graph() == graph) host->on_graph_change();
}

void SmallWorld::on_request(const Servant& servant, RequestKey key, const Payload& payload) {
  if (servant.spec.host >= 0)
    return hosts_[static_cast<std::size_t>(servant.spec.host)]->on_request(servant, key, payload);
  const Label label = checker_.calls().on_executed(services_, servant, key, payload);
  const auto answer = [this, id = servant.id, &servant, key, label] {
    const auto answered = Payload::adopt(make_message(label, 64, false));
    checker_.calls().on_answered(servant, label, answered);
    services_.answer(id, key, answered);
  };
  if (answer_takes_ == 0s) return answer();
  schedule_.after(answer_takes_, answer);
}

void SmallWorld::on_response(const Caller& caller, const Servant& servant, RequestKey key,
                             const Payload& payload) {
  if (caller.spec.host >= 0)
    return hosts_[static_cast<std::size_t>(caller.spec.host)]->on_response(caller, key, payload);
  checker_.calls().on_response(caller, servant, key, payload);
  on_answer(key);
}

void SmallWorld::on_found(const Caller& caller) {
  if (caller.spec.host >= 0) hosts_[static_cast<std::size_t>(caller.spec.host)]->on_found(caller);
}

void SmallWorld::on_caller_gone(const Caller& caller) {
  for (auto& host : hosts_)
    if (host->graph() == caller.spec.graph) host->on_caller_gone(caller);
}

}  // namespace connect_bridge::sim
