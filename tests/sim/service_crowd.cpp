#include "sim/service_crowd.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

namespace connect_bridge::sim {
using namespace std::chrono_literals;

std::string ServiceCrowd::local_name(int graph, const std::string& wire) const {
  for (const auto& host : scenario_.hosts) {
    if (host.graph == graph) return host.names.to_local(wire);
  }
  return wire;
}

void ServiceCrowd::tell(const std::string& what, const EndpointSpec& spec) const {
  if (!verbose_) return;
  std::printf("%9.4f graph %d %s: %s\n", seconds(schedule_.now()), spec.graph, what.c_str(),
              spec.topic.c_str());
}

EndpointSpec ServiceCrowd::spec(const ServicePlan& plan, int graph, const std::string& node) {
  EndpointSpec spec;
  spec.graph = graph;
  spec.topic = local_name(graph, plan.name);
  spec.type = plan.type;
  spec.type_hash = plan.type_hash;
  spec.node_namespace = "/app";
  spec.node_name = node;
  return spec;
}

void ServiceCrowd::add_servant(const ServicePlan& plan, int graph, const std::string& node) {
  const int id = services_.create_servant(spec(plan, graph, node));
  servants_.push_back(id);
  servant_plans_[id] = &plan;
  work_.add(id, plan);
  if (!plan.action.empty()) add_parts(plan, id);
  tell("server " + std::to_string(id), services_.servant(id).spec);
}

// As an action server makes them, one right after the other.
void ServiceCrowd::add_parts(const ServicePlan& plan, int servant) {
  EndpointSpec part = services_.servant(servant).spec;
  const std::string prefix = local_name(part.graph, plan.action) + "/_action/";
  const auto name_part = [&](const char* name, const std::string& type) {
    part.topic = prefix + name;
    part.type = type;
    part.type_hash = Services::hash_of(type);
    return part;
  };
  const std::string type = kActionType;
  Parts& parts = parts_[servant];
  parts.servants = {
      services_.create_servant(name_part("cancel_goal", "action_msgs/srv/CancelGoal")),
      services_.create_servant(name_part("get_result", type + "_GetResult"))};
  parts.writers = {
      middleware_.create_writer(name_part("feedback", type + "_FeedbackMessage")),
      middleware_.create_writer(name_part("status", "action_msgs/msg/GoalStatusArray"))};
  for (const int id : parts.servants) {
    servant_plans_[id] = &plan;
    work_.add(id, plan);
  }
}

std::vector<int> ServiceCrowd::servants() const {
  std::vector<int> all = servants_;
  for (const auto& [id, parts] : parts_) {
    all.insert(all.end(), parts.servants.begin(), parts.servants.end());
  }
  return all;
}

std::vector<int> ServiceCrowd::action_writers() const {
  std::vector<int> all;
  for (const auto& [id, parts] : parts_) {
    all.insert(all.end(), parts.writers.begin(), parts.writers.end());
  }
  return all;
}

void ServiceCrowd::remove_servant(std::size_t at, const char* why) {
  const int id = servants_[at];
  tell("server " + std::to_string(id) + " " + why, services_.servant(id).spec);
  servants_.erase(servants_.begin() + static_cast<std::ptrdiff_t>(at));
  services_.destroy_servant(id);
  const auto parts = parts_.find(id);
  if (parts == parts_.end()) return;
  for (const int part : parts->second.servants) services_.destroy_servant(part);
  for (const int part : parts->second.writers) middleware_.destroy_writer(part);
  parts_.erase(parts);
}

void ServiceCrowd::add_caller(const ServicePlan& plan, int graph) {
  const int id =
      services_.create_caller(spec(plan, graph, "caller" + std::to_string(++last_node_)));
  callers_.push_back(id);
  caller_plans_[id] = &plan;
  tell("client " + std::to_string(id), services_.caller(id).spec);
  if (!calm_) schedule_.after(rng_.between(0ms, plan.period), [this, id] { tick(id); });
}

void ServiceCrowd::remove_caller(std::size_t at) {
  const int id = callers_[at];
  tell("client " + std::to_string(id) + " is gone", services_.caller(id).spec);
  callers_.erase(callers_.begin() + static_cast<std::ptrdiff_t>(at));
  services_.destroy_caller(id);
}

void ServiceCrowd::add_lasting(const ServicePlan& plan) {
  add_servant(plan, plan.graphs.front(), "servant" + std::to_string(++last_node_));
  lasting_servants_.insert(servants_.back());
  for (int graph = 0; graph < static_cast<int>(scenario_.graphs.size()); ++graph) {
    if (graph == plan.graphs.front()) continue;
    add_caller(plan, graph);
    lasting_callers_.insert(callers_.back());
  }
}

void ServiceCrowd::start() {
  if (scenario_.services.empty()) return;
  for (const auto& plan : scenario_.services) {
    if (plan.lasting) add_lasting(plan);
    for (const int graph : plan.graphs) {
      schedule_.after(rng_.between(0ms, 2s), [this, &plan, graph] {
        if (!calm_) add_servant(plan, graph, "servant" + std::to_string(++last_node_));
      });
    }
    const auto callers = rng_.between(0, 3);
    for (int i = 0; i < callers; ++i) {
      const int graph = static_cast<int>(rng_.below(scenario_.graphs.size()));
      schedule_.after(rng_.between(0ms, 3s), [this, &plan, graph] {
        if (!calm_) add_caller(plan, graph);
      });
    }
  }
  schedule_.after(scenario_.churn, [this] { churn(); });
}

// Under the same name, at once or a little later.
void ServiceCrowd::restart_servant() {
  const auto at = rng_.below(servants_.size());
  if (lasting_servants_.contains(servants_[at])) return;
  const EndpointSpec old = services_.servant(servants_[at]).spec;
  const ServicePlan& plan = plan_of_servant(servants_[at]);
  remove_servant(at, "restarts");
  const Duration gap = rng_.chance(500) ? 0ms : rng_.between(1ms, 800ms);
  schedule_.after(gap, [this, &plan, old] {
    if (!calm_) add_servant(plan, old.graph, old.node_name);
  });
}

void ServiceCrowd::churn() {
  if (calm_) return;
  if (!paused_) change();
  schedule_.after(rng_.between(scenario_.churn / 4, scenario_.churn * 2), [this] { churn(); });
}

void ServiceCrowd::change() {
  const auto what = rng_.below(6);
  const ServicePlan& plan = rng_.pick(scenario_.services);
  if (what == 0 && servants_.size() < endpoints_max_) {
    add_servant(plan, rng_.pick(plan.graphs), "servant" + std::to_string(++last_node_));
  } else if (what == 1 && !servants_.empty()) {
    const auto at = rng_.below(servants_.size());
    if (!lasting_servants_.contains(servants_[at])) remove_servant(at, "is gone");
  } else if (what == 2 && !servants_.empty()) {
    restart_servant();
  } else if (what <= 4 && callers_.size() < endpoints_max_) {
    add_caller(plan, static_cast<int>(rng_.below(scenario_.graphs.size())));
  } else if (!callers_.empty()) {
    const auto at = rng_.below(callers_.size());
    if (!lasting_callers_.contains(callers_[at])) remove_caller(at);
  }
}

void ServiceCrowd::forget(TimePoint before) {
  work_.forget(before);
  const auto is_old = [before](const auto& endpoint) {
    return !endpoint.alive && endpoint.destroyed < before;
  };
  std::erase_if(servant_plans_, [&](const auto& p) { return is_old(services_.servant(p.first)); });
  std::erase_if(caller_plans_, [&](const auto& p) { return is_old(services_.caller(p.first)); });
}

// A burst of calls, then a pause.
void ServiceCrowd::tick(int caller) {
  if (calm_ || !services_.caller(caller).alive) return;
  const ServicePlan& plan = plan_of_caller(caller);
  if (!paused_ && services_.is_ready(caller)) {
    const auto burst = rng_.chance(700) ? 1 : rng_.between(2, plan.burst_max);
    for (int i = 0; i < burst; ++i) call(caller);
  }
  schedule_.after(rng_.between(plan.period / 2, plan.period * 3 / 2),
                  [this, caller] { tick(caller); });
}

void ServiceCrowd::call(int caller) {
  const ServicePlan& plan = plan_of_caller(caller);
  check_.on_call(caller);
  const std::uint32_t number = check_.called(caller);
  const Label label{kCallerLabels + static_cast<std::uint32_t>(caller), number};
  const auto size = static_cast<std::size_t>(rng_.between(32, plan.bytes_max));
  services_.call({caller, number}, Payload::adopt(make_message(label, size, plan.compressible)));
}

void ServiceCrowd::on_request(const Servant& servant, RequestKey key, const Payload& payload) {
  work_.on_request(servant, key, payload);
}

void ServiceCrowd::on_response(const Caller& caller, const Servant& servant, RequestKey key,
                               const Payload& payload) {
  check_.on_response(caller, servant, key, payload);
}

void ServiceCrowd::calm() {
  calm_ = true;
  work_.calm();
}

Duration ServiceCrowd::call_round(std::uint64_t known) {
  Duration at{}, longest{};
  for (const int caller : callers_) {
    if (!services_.is_ready(caller)) continue;
    schedule_.after(at, [this, caller] { call(caller); });
    const auto bytes = static_cast<std::uint64_t>(plan_of_caller(caller).bytes_max);
    const Duration one_way = scenario_.time_to_send(bytes, known);
    at += rng_.between(1ms, 10ms) + one_way;
    longest = std::max(longest, one_way);
  }
  return at + longest;  // the answer of the last one
}

void ServiceCrowd::shuffle() {
  for (const auto& plan : scenario_.services) {
    const auto what = rng_.below(3);
    const auto of_it = [&](int id) { return servant_plans_.at(id) == &plan; };
    if (what == 0) {
      for (std::size_t i = servants_.size(); i > 0; --i) {
        if (of_it(servants_[i - 1])) remove_servant(i - 1, "ends");
      }
    } else if (what == 1) {
      add_servant(plan, rng_.pick(plan.graphs), "servant" + std::to_string(++last_node_));
    }
  }
}

void ServiceCrowd::ask_for_results(Duration goal_time) {
  work_.take_time(goal_time);
  while (!callers_.empty()) remove_caller(callers_.size() - 1);
  for (const auto& plan : scenario_.services) {
    for (int graph = 0; !plan.action.empty() && graph < static_cast<int>(scenario_.graphs.size());
         ++graph) {
      EndpointSpec results = spec(plan, graph, "caller" + std::to_string(++last_node_));
      results.topic = local_name(graph, plan.action) + "/_action/get_result";
      results.type = std::string(kActionType) + "_GetResult";
      results.type_hash = Services::hash_of(results.type);
      const int id = services_.create_caller(results);
      callers_.push_back(id);
      caller_plans_[id] = &plan;
    }
  }
}

}  // namespace connect_bridge::sim
