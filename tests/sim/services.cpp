#include "sim/services.hpp"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

bool same_service(const EndpointSpec& a, const EndpointSpec& b) {
  return a.graph == b.graph && a.topic == b.topic && a.type == b.type;
}

}  // namespace

void Services::announce(const EndpointSpec& spec) {
  listener_.on_services_change(spec.graph);
  const Duration delay = middleware_.graph(spec.graph).name_delay;
  if (delay > 0ns) {
    schedule_.after(delay, [this, graph = spec.graph] { listener_.on_services_change(graph); });
  }
}

int Services::create_servant(EndpointSpec spec) {
  Servant& servant = servants_.add();
  servant.spec = std::move(spec);
  servant.gid = middleware_.new_gid(servant.spec);
  servant.created = schedule_.now();
  living_servants_.push_back(servant.id);
  for (const int id : living_callers_) plan_match(callers_[id], servant);
  announce(servant.spec);
  return servant.id;
}

int Services::create_caller(EndpointSpec spec) {
  Caller& caller = callers_.add();
  caller.spec = std::move(spec);
  caller.gid = middleware_.new_gid(caller.spec);
  living_callers_.push_back(caller.id);
  for (const int id : living_servants_) plan_match(caller, servants_[id]);
  return caller.id;
}

void Services::destroy_servant(int id) {
  Servant& servant = servants_[id];
  if (!servant.alive) return;
  servant.alive = false;
  servant.destroyed = schedule_.now();
  std::erase(living_servants_, id);
  listener_.on_services_change(servant.spec.graph);
  for (const int known : std::vector<int>(living_callers_)) {
    const auto& found = callers_[known].servants;
    if (std::find(found.begin(), found.end(), id) == found.end()) continue;
    listener_.on_found(callers_[known]);
  }
}

void Services::destroy_caller(int id) {
  Caller& caller = callers_[id];
  if (!caller.alive) return;
  caller.alive = false;
  caller.destroyed = schedule_.now();
  std::erase(living_callers_, id);
  listener_.on_caller_gone(caller);
}

void Services::plan_match(const Caller& caller, const Servant& servant) {
  if (!same_service(caller.spec, servant.spec) || same_process(caller.spec, servant.spec)) return;
  const Duration delay = rng_.between(1us, middleware_.graph(caller.spec.graph).discovery_max);
  schedule_.after(delay, [this, c = caller.id, s = servant.id] {
    if (!callers_[c].alive || !servants_[s].alive) return;
    callers_[c].servants.push_back(s);
    listener_.on_found(callers_[c]);
  });
}

void Services::forget(TimePoint before) {
  for (const int id : living_callers_) {
    Caller& caller = callers_[id];
    std::erase_if(caller.servants, [this](int found) { return !servants_[found].alive; });
    std::erase_if(caller.arrivals, [before](const auto& last) { return last.second < before; });
  }
  servants_.forget(before);
  callers_.forget(before);
}

bool Services::is_ready(int caller) const {
  const auto& found = callers_[caller].servants;
  return std::any_of(found.begin(), found.end(), [this](int id) { return servants_[id].alive; });
}

int Services::call(RequestKey key, const Payload& payload) {
  Caller& caller = callers_[key.caller];
  if (!caller.alive) violated("a client that does not exist calls");
  std::erase_if(caller.servants, [this](int id) { return !servants_[id].alive; });
  for (const int id : caller.servants) {
    TimePoint& arrival = caller.arrivals[id];
    arrival = std::max(arrival, schedule_.now() + rng_.between(Duration{20us}, 300us));
    schedule_.at(arrival, [this, id, key, payload] {
      if (servants_[id].alive) listener_.on_request(servants_[id], key, payload);
    });
  }
  return static_cast<int>(caller.servants.size());
}

void Services::answer(int servant, RequestKey key, const Payload& payload) {
  if (!servants_[servant].alive) violated("a server that does not exist answers");
  schedule_.after(rng_.between(Duration{20us}, 300us), [this, servant, key, payload] {
    const Caller& caller = callers_[key.caller];
    if (caller.alive) listener_.on_response(caller, servants_[servant], key, payload);
  });
}

std::vector<ServiceState> Services::snapshot(int graph, int host) const {
  std::map<std::pair<std::string, std::string>, ServiceState> services;
  const GraphPlan& plan = middleware_.graph(graph);
  for (const int id : living_servants_) {
    const Servant& servant = servants_[id];
    const EndpointSpec& spec = servant.spec;
    if (spec.graph != graph || spec.host == host) continue;
    Server seen{plan.tells_servers ? servant.gid : Gid{}, spec.node_namespace, spec.node_name};
    if (schedule_.now() < servant.created + plan.name_delay) {
      seen.node_name = "_NODE_NAME_UNKNOWN_";
      seen.node_namespace = "_NODE_NAMESPACE_UNKNOWN_";
    }
    services[{spec.topic, spec.type}].servers.push_back(std::move(seen));
  }
  std::vector<ServiceState> result;
  for (auto& [key, service] : services) {
    std::tie(service.name, service.type) = key;
    service.lack = middleware_.lack_of(graph, service.type);
    result.push_back(std::move(service));
  }
  return result;
}

}  // namespace connect_bridge::sim
