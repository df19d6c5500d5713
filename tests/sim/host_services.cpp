// What a host does with services: the gateway's part, as ports.hpp promises it to the core.
#include <utility>

#include "core/base/cdr.hpp"
#include "core/policy/interface.hpp"
#include "sim/checker.hpp"
#include "sim/host.hpp"

namespace connect_bridge::sim {

using namespace std::chrono_literals;

// ---- mirrors
// -----------------------------------------------------------------------------------------

void Host::act(const CreateServiceMirror& action) {
  if (service_mirrors_.contains(action.id)) violated("a service mirror is created twice");
  if (plan_.options.drive_switch && is_drive_switch(action.service, plan_.options.node)) {
    drive_switch_ = action.id;
    return;
  }
  if (!world_.middleware.knows_type(plan_.graph, action.type)) {
    failed_service_mirrors_.insert(action.id);
    later(rng_.between(1us, 2ms), [action]() -> Input {
      return ServiceMirrorFailed{action.id, "type_unknown", "the type is not installed"};
    });
    return;
  }
  const int servant = world_.services.create_servant(
      endpoint(action.service, action.type, action.type_hash, {}, action.id.value));
  service_mirrors_[action.id] = ServiceMirrorInfo{servant, action, 0, {}};
  tell("mirrors service " + action.service + " as server " + std::to_string(servant));
  world_.checker.on_service_mirror(*this, action);
}

void Host::act(const DestroyServiceMirror& action) {
  const auto it = service_mirrors_.find(action.id);
  if (it == service_mirrors_.end()) {
    if (!failed_service_mirrors_.contains(action.id)) {
      violated("a service mirror that does not exist is destroyed");
    }
    return;
  }
  tell("ends server " + std::to_string(it->second.servant) + " of " + it->second.made.service);
  world_.checker.calls().on_mirror_gone(*this, action.id);
  const int servant = it->second.servant;
  service_mirrors_.erase(it);
  world_.services.destroy_servant(servant);
}

void Host::on_request(const Servant& servant, RequestKey key, const Payload& payload) {
  const ServiceMirrorId id{servant.spec.handle};
  const auto it = service_mirrors_.find(id);
  if (!side_ || it == service_mirrors_.end() || it->second.servant != servant.id) return;
  const RequestId request{++it->second.last_request};
  it->second.requests[request] = key;
  world_.checker.calls().on_taken(*this, id, request, world_.services.caller(key.caller), payload);
  const ByteView view = payload.view();
  input(RequestTaken{id, request, counted(Bytes{view.begin(), view.end()})});
}

void Host::drive(bool take) {
  if (!side_ || !drive_switch_) return;
  const RequestId request{++drive_calls_};
  open_drive_calls_.insert(request);
  input(RequestTaken{drive_switch_, request, CdrWriter().u8(take ? 1 : 0).take()});
}

void Host::act(const SendResponse& action) {
  if (drive_switch_ && action.mirror == drive_switch_) {
    if (open_drive_calls_.erase(action.request) == 0)
      violated("a call of ~/drive is answered twice");
    return;
  }
  const auto it = service_mirrors_.find(action.mirror);
  if (it == service_mirrors_.end()) violated("an answer at a mirror that does not exist");
  world_.checker.calls().on_send_response(*this, action,
                                          world_.services.servant(it->second.servant).spec);
  const RequestKey key = it->second.requests.at(action.request);
  it->second.requests.erase(action.request);
  world_.services.answer(it->second.servant, key, Payload::copy_of(action.payload.view()));
}

void Host::act(const DropRequest& action) {
  if (drive_switch_ && action.mirror == drive_switch_) {
    open_drive_calls_.erase(action.request);
    return;
  }
  const auto it = service_mirrors_.find(action.mirror);
  if (it == service_mirrors_.end())
    violated("a request is dropped at a mirror that does not exist");
  world_.checker.calls().on_request_dropped(*this, action);
  it->second.requests.erase(action.request);
}

void Host::on_caller_gone(const Caller& caller) {
  for (const auto& [mirror, info] : service_mirrors_) {
    if (world_.checker.calls().open_requests_of(*this, mirror, caller.id).empty()) continue;
    later(rng_.between(Duration{100us}, plan_.graph_delay_max),
          [this, id = mirror, gone = caller.id]() -> Input {
            CallersGone input{id, {}};
            const auto it = service_mirrors_.find(id);
            if (it == service_mirrors_.end()) return TimePassed{};
            input.requests = world_.checker.calls().open_requests_of(*this, id, gone);
            for (const RequestId request : input.requests) it->second.requests.erase(request);
            world_.checker.calls().on_callers_gone(*this, input);
            if (input.requests.empty()) return TimePassed{};
            return input;
          });
  }
}

// ---- clients
// -----------------------------------------------------------------------------------------

void Host::act(const CreateServiceClient& action) {
  if (service_clients_.contains(action.id)) violated("a service client is created twice");
  if (!world_.middleware.knows_type(plan_.graph, action.type)) {
    failed_service_clients_.insert(action.id);
    later(rng_.between(1us, 2ms), [action]() -> Input {
      return ServiceClientFailed{action.id, "type_unknown", "the type is not installed"};
    });
    return;
  }
  const int caller =
      world_.services.create_caller(endpoint(action.service, action.type, "", {}, action.id.value));
  service_clients_[action.id] = ServiceClientInfo{caller, action, false, false, {}};
  tell("is a client of " + action.service);
  world_.checker.on_service_client(*this, action);
}

void Host::act(const DestroyServiceClient& action) {
  const auto it = service_clients_.find(action.id);
  if (it == service_clients_.end()) {
    if (!failed_service_clients_.contains(action.id)) {
      violated("a service client that does not exist is destroyed");
    }
    return;
  }
  tell("is no longer a client of " + it->second.made.service);
  world_.checker.calls().on_client_gone(*this, action.id);
  const int caller = it->second.caller;
  service_clients_.erase(it);
  world_.services.destroy_caller(caller);
}

// The gateway looks after each change of the graph, and tells what is new.
void Host::on_found(const Caller& caller) {
  later(rng_.between(1us, plan_.graph_delay_max),
        [this, id = ServiceClientId{caller.spec.handle}]() -> Input {
          const auto it = service_clients_.find(id);
          if (it == service_clients_.end()) return TimePassed{};
          ServiceClientInfo& info = it->second;
          if (info.made.service == kDeafService) return TimePassed{};
          const bool ready = world_.services.is_ready(info.caller);
          if (ready == info.ready) return TimePassed{};
          info.ready = ready;
          if (!ready && !info.told) return TimePassed{};
          info.told = true;
          return ServiceReady{id, ready, world_.services.hash_of(info.made.type)};
        });
}

void Host::act(const SendRequest& action) {
  const auto it = service_clients_.find(action.client);
  if (it == service_clients_.end()) violated("a request by a client that does not exist");
  if (!it->second.told) violated("a request before its service is known to be ready");
  if (!action.line) violated("a call that the audit log does not have");
  const Caller& caller = world_.services.caller(it->second.caller);
  world_.checker.calls().on_send_request(*this, action, caller);
  const int reached = world_.services.call({caller.id, action.invocation.value},
                                           Payload::copy_of(action.payload.view()));
  if (reached > 0 || rng_.chance(500)) return;  // a request to nobody is lost, or fails
  later(rng_.between(1us, 1ms), [this, action]() -> Input {
    if (!world_.checker.calls().is_open(*this, action.client, action.invocation)) {
      return TimePassed{};
    }
    world_.checker.calls().on_invocation_over(*this, action.client, action.invocation);
    return InvocationFailed{action.client, action.invocation, "there is no server"};
  });
}

void Host::on_response(const Caller& caller, RequestKey key, const Payload& payload) {
  const ServiceClientId client{caller.spec.handle};
  const InvocationId invocation{key.number};
  const auto it = service_clients_.find(client);
  if (!side_ || it == service_clients_.end()) return;
  if (it->second.dropped.erase(invocation) > 0) return input(ResponseTaken{client, invocation, {}});
  if (!world_.checker.calls().is_open(*this, client, invocation)) return;
  world_.checker.calls().on_invocation_over(*this, client, invocation);
  const ByteView view = payload.view();
  input(ResponseTaken{client, invocation, counted(Bytes{view.begin(), view.end()})});
}

void Host::act(const DropInvocation& action) {
  const auto it = service_clients_.find(action.client);
  if (it == service_clients_.end()) {
    violated("an invocation of a client that does not exist is dropped");
  }
  it->second.dropped.insert(action.invocation);
  world_.checker.calls().on_invocation_over(*this, action.client, action.invocation);
}

}  // namespace connect_bridge::sim
