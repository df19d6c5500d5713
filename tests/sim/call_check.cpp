#include "sim/call_check.hpp"

#include <algorithm>

namespace connect_bridge::sim {
namespace {

// The importer gives the exporter a second to say why.
constexpr Duration kTimeLimitSlack = std::chrono::milliseconds(1200);

std::string text(int caller, std::uint64_t number) {
  return "call " + std::to_string(number) + " of client " + std::to_string(caller);
}

}  // namespace

CallCheck::CallKey CallCheck::call_of(const Payload& request, const std::string& where) const {
  const auto label = is_intact(request.view()) ? read_label(request.view()) : std::nullopt;
  if (!label || label->writer < kCallerLabels || label->writer >= kServantLabels) {
    violated("bytes that nobody sent as a request arrive at " + where);
  }
  const CallKey key{static_cast<int>(label->writer - kCallerLabels),
                    static_cast<std::uint32_t>(label->counter)};
  if (key.number == 0 || key.number > called(key.caller)) {
    violated("a call that was never made arrives at " + where);
  }
  return key;
}

std::uint32_t CallCheck::called(int caller) const {
  const auto it = called_.find(caller);
  return it == called_.end() ? 0 : it->second;
}

// ---- ordinary nodes
// ----------------------------------------------------------------------------------

Label CallCheck::on_executed(const Services& services, const Servant& servant, RequestKey key,
                             const Payload& request) {
  const CallKey which = call_of(request, "server " + std::to_string(servant.id));
  Call& call = calls_[which];
  call.last = ledger_.now();
  const bool relayed = services.caller(key.caller).spec.host >= 0;
  const int times = ++(relayed ? call.relayed : call.direct)[servant.id];
  const int allowed = relayed ? call.takings : 1;
  ledger_.coverage().count(Judged::kExecutions);
  // A request for a goal's result is made again after a break.
  const bool may_repeat = relayed && servant.spec.topic.ends_with("/_action/get_result");
  if (times > allowed && !may_repeat) {
    violated(text(which.caller, which.number) + ", taken " + std::to_string(allowed) +
             " times, is executed " + std::to_string(times) + " times by server " +
             std::to_string(servant.id) + " of " + servant.spec.topic);
  }
  executions_[++executed_] = {which, servant.id, 0, 0, ledger_.now()};
  return Label{kServantLabels + static_cast<std::uint32_t>(servant.id), executed_};
}

const CallCheck::Execution& CallCheck::execution_of(const Label& response) const {
  const auto it = executions_.find(response.counter);
  if (it == executions_.end()) violated("an answer to a call of long ago");
  return it->second;
}

void CallCheck::on_answered(const Servant&, const Label& response, const Payload& payload) {
  const auto it = executions_.find(response.counter);
  if (it == executions_.end()) return;  // it was put off for so long that nobody asks for it
  Execution& execution = it->second;
  execution.bytes = payload.size();
  ++execution.answers;
}

void CallCheck::on_response(const Caller& caller, const Servant& servant, RequestKey key,
                            const Payload& payload) {
  const std::string what = text(caller.id, key.number);
  const auto label = is_intact(payload.view()) ? read_label(payload.view()) : std::nullopt;
  if (!label || label->writer < kServantLabels) violated(what + " is answered by damaged bytes");
  const Execution& execution = execution_of(*label);
  if (execution.call != CallKey{caller.id, key.number}) {
    violated(what + " gets the answer to " + text(execution.call.caller, execution.call.number));
  }
  Call& call = calls_[execution.call];
  if (servant.spec.host < 0) return;  // a local server's answer
  ++call.answers;
  ledger_.coverage().count(Judged::kAnswers);
  if (call.answers > call.takings) violated(what + " is answered twice");
}

void CallCheck::on_lost(const Caller& caller, const Servant& servant, RequestKey key, bool shared) {
  if (caller.spec.host < 0) return;  // as ROS has it
  const auto client = clients_.find({caller.spec.host, ServiceClientId{caller.spec.handle}});
  if (client == clients_.end()) return;
  const auto open = client->second.open.find(InvocationId{key.number});
  if (open == client->second.open.end()) return;  // nobody waits for it
  Invocation& invocation = open->second;
  ledger_.coverage().count(Judged::kLosses);
  invocation.lost.insert(servant.id);
  if (shared) return;
  violated(text(invocation.call.caller, invocation.call.number) +
           " falls out of the queue of server " + std::to_string(servant.id) + " of " +
           servant.spec.topic + ", where only side " + std::to_string(caller.spec.host) + " calls");
}

int CallCheck::answers(int caller, std::uint32_t number) const {
  const auto it = calls_.find({caller, number});
  return it == calls_.end() ? 0 : it->second.answers;
}

int CallCheck::executions(int caller, std::uint32_t number) const {
  const auto it = calls_.find({caller, number});
  if (it == calls_.end()) return 0;
  int most = 0;
  for (const auto& [servant, times] : it->second.relayed) most = std::max(most, times);
  return most;
}

// ---- the importing side
// ------------------------------------------------------------------------------

void CallCheck::on_taken(const Host& host, ServiceMirrorId mirror, RequestId request,
                         const Caller& caller, const Payload& payload) {
  const bool strange = is_hostile(caller.spec.topic);
  const CallKey which = strange ? CallKey{} : call_of(payload, describe(host));
  if (strange) {
    // Its owner cannot be identified.
  } else if (caller.spec.host < 0) {
    // Each of two mirrors would have it executed.
    if (++calls_[which].takings > 1)
      violated(text(which.caller, which.number) + " is taken by two mirrors, the second one at " +
               describe(host));
    calls_[which].last = ledger_.now();
  } else {
    violated(text(which.caller, which.number) + " runs in circles: the mirror at " +
             describe(host) + " takes it from a bridge");
  }
  TopicMirror& state = mirrors_[{host.index(), mirror}];
  state.last = request;
  state.open[request] = OpenRequest{which, caller.id, ledger_.now()};
}

void CallCheck::on_send_response(const Host& host, const SendResponse& action,
                                 const EndpointSpec& mirror) {
  TopicMirror& state = mirrors_[{host.index(), action.mirror}];
  const auto it = state.open.find(action.request);
  const std::string where = describe(host) + " answers a request of " + mirror.topic;
  if (it == state.open.end()) {
    if (action.request.value == 0 || action.request > state.last) {
      violated(where + " that was never made");
    }
    // Its caller may have gone while the answer was on its way; a second one is an error.
    violated(where + " that is answered or given up already");
  }
  if (is_hostile(mirror.topic)) {
    state.open.erase(it);
    return;
  }
  const auto label =
      is_intact(action.payload.view()) ? read_label(action.payload.view()) : std::nullopt;
  if (!label || label->writer < kServantLabels) violated(where + " with damaged bytes");
  const Execution& execution = execution_of(*label);
  if (execution.call != it->second.call) {
    violated(where + ", " + text(it->second.call.caller, it->second.call.number) +
             ", with the answer to " + text(execution.call.caller, execution.call.number));
  }
  if (execution.bytes != action.payload.size()) violated(where + " with bytes that no server gave");
  state.open.erase(it);
}

void CallCheck::on_request_dropped(const Host& host, const DropRequest& action) {
  TopicMirror& state = mirrors_[{host.index(), action.mirror}];
  if (state.gone.erase(action.request) + state.open.erase(action.request) == 0) {
    violated(describe(host) + " drops a request that is not open");
  }
  ledger_.coverage().count(Judged::kDrops);
}

void CallCheck::on_callers_gone(const Host& host, const CallersGone& input) {
  TopicMirror& state = mirrors_[{host.index(), input.mirror}];
  for (const RequestId gone : input.requests) {
    if (state.open.erase(gone) > 0) state.gone.insert(gone);
  }
}

void CallCheck::on_mirror_gone(const Host& host, ServiceMirrorId mirror) {
  mirrors_.erase({host.index(), mirror});
}

std::vector<RequestId> CallCheck::open_requests_of(const Host& host, ServiceMirrorId mirror,
                                                   int caller) const {
  std::vector<RequestId> result;
  const auto it = mirrors_.find({host.index(), mirror});
  if (it == mirrors_.end()) return result;
  for (const auto& [id, open] : it->second.open) {
    if (open.caller == caller) result.push_back(id);
  }
  return result;
}

// ---- the exporting side
// ------------------------------------------------------------------------------

void CallCheck::on_send_request(const Host& host, const SendRequest& action, const Caller& caller) {
  const CallKey which =
      is_hostile(caller.spec.topic)
          ? CallKey{}
          : call_of(action.payload, caller.spec.topic + ", handed over by " + describe(host));
  Client& client = clients_[{host.index(), action.client}];
  if (action.invocation <= client.last) {
    violated(describe(host) + " uses the number of an invocation twice");
  }
  client.last = action.invocation;
  client.open[action.invocation] = Invocation{ledger_.now(), which, caller.servants, {}};
  check_caps(host, caller.spec, client);
}

Treatment CallCheck::limits_of(const Host& host, Direction direction, const std::string& name,
                               const std::string& type) const {
  Treatment most;
  most.calls_max = 0;
  most.call_timeout = Duration::zero();
  const auto wire = host.plan().names.to_wire(name);
  const auto add = [&](const Identity& who) {
    const auto treatment =
        service_treatment_of(host.policy(), direction, wire.value_or(""), type, who);
    if (!treatment) return;
    most.calls_max = std::max(most.calls_max, treatment->calls_max);
    most.call_timeout = std::max(most.call_timeout, treatment->call_timeout);
  };
  for (const auto& peer : ledger_.peers_of(host)) add(peer.seen_as);
  if (host.meets_strangers()) add(Identity{kStranger, {}, 0});
  return most;
}

void CallCheck::inspect(const Host& host) const {
  if (ledger_.policies_of(host) > 1) return;  // what was begun under other rules stays
  for (const auto& [id, info] : host.service_mirrors()) {
    const auto state = mirrors_.find({host.index(), id});
    if (state == mirrors_.end()) continue;
    if (info.made.service.ends_with("/_action/get_result")) continue;  // a goal takes its time
    const Duration limit =
        limits_of(host, Direction::kImport, info.made.service, info.made.type).call_timeout;
    if (limit == kForever) continue;
    for (const auto& [request, open] : state->second.open) {
      if (ledger_.now() - open.taken < limit + kTimeLimitSlack) continue;
      violated(text(open.call.caller, open.call.number) + " is open at " + describe(host) +
               " beyond its time limit of " + std::to_string(seconds(limit)) + " s");
    }
  }
}

void CallCheck::check_caps(const Host& host, const EndpointSpec& spec, const Client& client) const {
  if (ledger_.policies_of(host) > 1) return;  // what was begun under other rules stays
  const std::uint64_t links = host.status().links.size();
  const std::uint64_t of_service =
      links * limits_of(host, Direction::kExport, spec.topic, spec.type).calls_max;
  ledger_.coverage().count(Judged::kCaps);
  if (client.open.size() > of_service) {
    violated(describe(host) + " has " + std::to_string(client.open.size()) +
             " calls under way at " + spec.topic + ", more than " + std::to_string(of_service));
  }
}

void CallCheck::on_invocation_over(const Host& host, ServiceClientId client,
                                   InvocationId invocation) {
  clients_[{host.index(), client}].open.erase(invocation);
}

void CallCheck::on_client_gone(const Host& host, ServiceClientId client) {
  clients_.erase({host.index(), client});
}

void CallCheck::on_end(const Host& host) {
  std::erase_if(mirrors_, [&](const auto& m) { return m.first.first == host.index(); });
  std::erase_if(clients_, [&](const auto& c) { return c.first.first == host.index(); });
}

// ---- when all is quiet
// -------------------------------------------------------------------------------

// If a server ends while another one of its service lives, the middleware does not show which of
// them has a call; nor do all middlewares show that a server was replaced at once, or that its
// queue was full. Then the call goes on waiting, as it would for a local client.
bool CallCheck::is_lost(const Services& services, const Invocation& invocation) const {
  const auto is_unnoticed = [&](int id) {
    if (invocation.lost.contains(id)) return true;
    const Servant& gone = services.servant(id);
    if (gone.alive) return false;
    if (!ledger_.middleware().graph(gone.spec.graph).tells_servers) return true;
    return services.servants().any([&](const Servant& other) {
      return other.id != id && other.spec.graph == gone.spec.graph &&
             other.spec.topic == gone.spec.topic && other.created < gone.destroyed &&
             (other.alive || other.destroyed >= gone.destroyed);
    });
  };
  if (invocation.servants.empty()) return true;  // it reached no server
  return std::all_of(
             invocation.servants.begin(), invocation.servants.end(),
             [&](int id) { return !services.servant(id).alive || invocation.lost.contains(id); }) &&
         std::any_of(invocation.servants.begin(), invocation.servants.end(), is_unnoticed);
}

bool CallCheck::has_lost(const Services& services) const {
  for (const auto& [key, client] : clients_) {
    for (const auto& [id, invocation] : client.open) {
      if (is_lost(services, invocation)) return true;
    }
  }
  return false;
}

void CallCheck::check_nothing_pending(const Services& services) const {
  std::map<CallKey, int> under_way;
  bool lost = false;
  for (const auto& [key, client] : clients_) {
    for (const auto& [id, invocation] : client.open) {
      ++under_way[invocation.call];
      if (is_lost(services, invocation)) {
        lost = true;
        continue;
      }
      std::string servers;
      for (const int servant : invocation.servants) {
        servers += " " + std::to_string(servant);
        if (!services.servant(servant).alive) servers += " (gone)";
      }
      violated(text(invocation.call.caller, invocation.call.number) +
               " is still under way although its servers have answered or ended:" + servers);
    }
  }
  if (lost) return;  // others may wait behind it
  for (const auto& [key, mirror] : mirrors_) {
    if (!mirror.gone.empty()) {
      violated("side " + std::to_string(key.first) + " keeps requests whose callers have gone");
    }
    for (const auto& [id, open] : mirror.open) {
      if (under_way.contains(open.call)) continue;
      violated(text(open.call.caller, open.call.number) + " waits at the mirror of side " +
               std::to_string(key.first) + " although nobody works on it");
    }
  }
}

void CallCheck::forget(const Services& services, TimePoint before) {
  for (const auto& [key, client] : clients_)
    for (const auto& [id, invocation] : client.open)
      if (invocation.sent < before)
        violated(text(invocation.call.caller, invocation.call.number) + " has been under way at " +
                 "side " + std::to_string(key.first) + " for " +
                 std::to_string(seconds(ledger_.now() - invocation.sent)) + " s");
  std::erase_if(called_, [&](const auto& c) { return !services.callers().knows(c.first); });
  std::erase_if(calls_, [&](const auto& c) { return c.second.last < before; });
  std::erase_if(executions_, [&](const auto& e) { return e.second.at < before; });
}

bool CallCheck::is_open(const Host& host, ServiceClientId client, InvocationId which) const {
  const auto it = clients_.find({host.index(), client});
  return it != clients_.end() && it->second.open.contains(which);
}

}  // namespace connect_bridge::sim
