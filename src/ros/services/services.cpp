#include "ros/services/services.hpp"

#include <algorithm>
#include <bit>

#include "core/base/check.hpp"

namespace connect_bridge::ros {
namespace {

// The graph shows a server shortly before our client is connected with it. So long after a change
// it is looked at again, ever less often.
constexpr auto kSettling = std::chrono::milliseconds(400);
constexpr Duration kFirstLook = std::chrono::milliseconds(5);
// What was ready and is not must stay so for this time: while one of two servers comes or goes, the
// middleware says for a moment that there is none.
constexpr Duration kLossPatience = std::chrono::milliseconds(75);

}  // namespace

Services::Services(ServicePorts ports, std::uint32_t mirror_kind, std::uint32_t client_kind)
    : ports_(std::move(ports)), mirror_kind_(mirror_kind), client_kind_(client_kind) {}

void Services::clear() {
  mirrors_.clear();
  clients_.clear();
}

// A message of many short strings takes several times the memory of its bytes.
std::size_t Services::memory_max() const {
  return std::size_t{4} * ports_.message_bytes_max;
}

void Services::apply(const CreateServiceMirror& action) {
  const auto type = ports_.types.service(action.type, action.type_hash);
  if (const auto* refusal = std::get_if<TypeRefusal>(&type)) {
    return ports_.report(ServiceMirrorFailed{action.id, refusal->code, refusal->reason});
  }
  auto* slot = ports_.ready.acquire(nullptr, mirror_kind_);
  auto made = std::make_unique<ServiceMirror>(
      ServiceMirror::Setup{action.id, action.service, std::get<0>(type),
                           ports_.proxies.get(action.node)},
      slot);
  slot->owner = made.get();
  if (const auto problem = made->open()) {
    made.reset();
    ports_.ready.release(slot);
    return ports_.report(ServiceMirrorFailed{action.id, "failed", *problem});
  }
  const bool inserted = mirrors_.emplace(action.id, std::move(made)).second;
  CONNECT_CHECK(inserted);
}

void Services::apply(const DestroyServiceMirror& action) {
  const auto found = mirrors_.find(action.id);
  if (found == mirrors_.end()) return;
  ReadyList::Slot* slot = found->second->slot();
  mirrors_.erase(found);
  ports_.ready.release(slot);
}

void Services::apply(const SendResponse& action) {
  const auto found = mirrors_.find(action.mirror);
  if (found == mirrors_.end()) return;
  const auto problem = found->second->respond(action.request, action.payload.view(), memory_max());
  if (problem) refused(*problem);
}

// The 1st, 2nd, 4th, 8th ... is logged.
void Services::refused(const std::string& what) {
  if (!std::has_single_bit(++counters_.refused)) return;
  ports_.node.log(LogLevel::kWarn,
                  what + " (failures so far: " + std::to_string(counters_.refused) + ")");
}

void Services::apply(const DropRequest& action) {
  const auto found = mirrors_.find(action.mirror);
  if (found != mirrors_.end()) found->second->drop(action.request);
}

void Services::apply(const CreateServiceClient& action) {
  const auto type = ports_.types.service(action.type, {});
  if (const auto* refusal = std::get_if<TypeRefusal>(&type)) {
    return ports_.report(ServiceClientFailed{action.id, refusal->code, refusal->reason});
  }
  auto* slot = ports_.ready.acquire(nullptr, client_kind_);
  auto made = std::make_unique<ServiceClient>(
      ports_.node, ServiceClient::Setup{action.id, action.service, std::get<0>(type)}, slot);
  slot->owner = made.get();
  if (const auto problem = made->open()) {
    made.reset();
    ports_.ready.release(slot);
    return ports_.report(ServiceClientFailed{action.id, "failed", *problem});
  }
  const bool inserted = clients_.emplace(action.id, std::move(made)).second;
  CONNECT_CHECK(inserted);
  watch_services();
  changed_ = std::chrono::steady_clock::now();
  ports_.look_again(Duration::zero());
}

void Services::watch_services() {
  std::set<std::string> names;
  for (const auto& [id, client] : clients_) names.insert(client->service());
  ports_.watch(std::move(names));
}

void Services::apply(const DestroyServiceClient& action) {
  const auto found = clients_.find(action.id);
  if (found == clients_.end()) return;
  ReadyList::Slot* slot = found->second->slot();
  clients_.erase(found);
  ports_.ready.release(slot);
  watch_services();
}

void Services::apply(const SendRequest& action) {
  const auto found = clients_.find(action.client);
  if (found == clients_.end()) return;
  const auto problem = found->second->send(action.invocation, action.payload.view(), memory_max());
  if (!problem) return;
  ++counters_.refused;
  ports_.report(InvocationFailed{action.client, action.invocation, *problem});
}

void Services::apply(const DropInvocation& action) {
  const auto found = clients_.find(action.client);
  if (found != clients_.end()) found->second->drop(action.invocation);
}

std::optional<Input> Services::step_mirror(ReadyList::Slot& slot, std::size_t& bytes) {
  auto& mirror = *static_cast<ServiceMirror*>(slot.owner);
  RequestTaken request;
  std::string problem;
  const auto taken = mirror.take(ports_.buffer, request, problem);
  if (!problem.empty()) refused(problem);
  switch (taken) {
    case ServiceMirror::Taken::kNothing: slot.bits_of_turn &= ~kReadyMessage; return std::nullopt;
    case ServiceMirror::Taken::kInvalid: return std::nullopt;
    case ServiceMirror::Taken::kRequest: break;
  }
  bytes += request.payload.size();
  if (mirror.has_new_callers()) ports_.look_again(Duration::zero());
  if (request.payload.size() <= ports_.message_bytes_max) {
    ++counters_.requests;
    return Input{std::move(request)};
  }
  mirror.drop(request.request);
  refused("a request of " + mirror.service() + " is dropped: it has " +
          std::to_string(request.payload.size()) + " bytes, more than " +
          std::to_string(ports_.message_bytes_max));
  return std::nullopt;
}

std::optional<Input> Services::step_client(ReadyList::Slot& slot, std::size_t& bytes) {
  auto& client = *static_cast<ServiceClient*>(slot.owner);
  ResponseTaken response;
  std::string problem;
  const auto taken = client.take(ports_.buffer, response, problem);
  if (taken == ServiceClient::Taken::kFailed) {
    ++counters_.refused;
    return InvocationFailed{response.client, response.invocation, std::move(problem)};
  }
  if (!problem.empty()) refused(problem);
  if (taken == ServiceClient::Taken::kNothing) slot.bits_of_turn &= ~kReadyMessage;
  if (taken == ServiceClient::Taken::kUnwanted) return Input{std::move(response)};
  if (taken != ServiceClient::Taken::kResponse) return std::nullopt;
  bytes += response.payload.size();
  if (response.payload.size() > ports_.message_bytes_max) {
    ++counters_.refused;
    return InvocationFailed{response.client, response.invocation,
                            "the answer has " + std::to_string(response.payload.size()) +
                                " bytes, more than " + std::to_string(ports_.message_bytes_max)};
  }
  ++counters_.responses;
  return Input{std::move(response)};
}

void Services::look_at_graph(bool changed) {
  if (changed) changed_ = std::chrono::steady_clock::now();
  look_for_servers();
  look_for_callers(changed);
}

void Services::look_for_servers() {
  const auto now = std::chrono::steady_clock::now();
  bool missing = false, losing = false;
  for (auto& [id, client] : clients_) {
    const bool ready = client->is_ready();
    if (ready) {
      client->missing_since.reset();
      if (!client->told_ready) tell_ready(*client, true);
      continue;
    }
    missing = true;
    if (!client->told_ready) continue;
    if (!client->missing_since) client->missing_since = now;
    if (now - *client->missing_since >= kLossPatience) {
      tell_ready(*client, false);
    } else {
      losing = true;
    }
  }
  const auto settling = now - changed_;
  if (losing) {
    ports_.look_again(kLossPatience / 3);
  } else if (missing && settling < kSettling) {
    ports_.look_again(std::max<Duration>(kFirstLook, settling / 2));
  }
}

void Services::tell_ready(ServiceClient& client, bool ready) {
  client.told_ready = ready;
  ports_.report(ServiceReady{client.id(), ready, client.type_hash()});
}

void Services::look_for_callers(bool changed) {
  bool doubtful = false;
  for (auto& [id, mirror] : mirrors_) {
    if (changed) mirror->graph_changed();
    if (changed || mirror->has_new_callers() || mirror->has_doubtful_callers()) {
      auto gone = mirror->look_for_callers();
      if (!gone.empty()) ports_.report(CallersGone{id, std::move(gone)});
    }
    doubtful = doubtful || mirror->has_doubtful_callers();
  }
  if (doubtful) ports_.look_again(ServiceMirror::kDoubt);
}

std::size_t Services::pending() const {
  std::size_t count = 0;
  for (const auto& [id, mirror] : mirrors_) count += mirror->requests();
  for (const auto& [id, client] : clients_) count += client->invocations();
  return count;
}

}  // namespace connect_bridge::ros
