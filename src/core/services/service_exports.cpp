// Which services are offered to which link, and who is attached. Their servers are in
// service_exports_servers.cpp, calls in service_exports_calls.cpp.
#include "core/services/service_exports.hpp"

#include <algorithm>

#include "core/link/options.hpp"
#include "core/policy/interface.hpp"

namespace connect_bridge {
namespace {

// Channels of requests that a peer has not confirmed the end of; one that honours the protocol does
// so within a round trip.
constexpr std::uint32_t kEndedChannelsMax = 4096;
// An attach may make a client, which costs the middleware about a millisecond.
constexpr Duration kAttachPeriod = std::chrono::milliseconds(5);
constexpr int kAttachesAtOnce = 12'000;
// After a reconnect the peer has this long to attach again to what it had been attached to.
constexpr Duration kAttachTime = std::chrono::seconds(30);

}  // namespace

bool is_result_service(const std::string& name) {
  return name.ends_with("/_action/get_result");
}

ServiceExports::ServiceExports(const SideOptions& options, const Policy& policy,
                               const GraphView& graph, const Claims& claims,
                               const LocalActions& actions, Random& random, LinkTable& links,
                               Outputs& outputs)
    : options_(options),
      policy_(policy),
      graph_(graph),
      claims_(claims),
      actions_(actions),
      random_(random),
      links_(links),
      outputs_(outputs) {}

ServiceExports::~ServiceExports() = default;

void ServiceExports::on_graph(const Now& now) {
  const auto is_real = [&](const ServiceKey& key) {
    // What another bridge mirrors is served elsewhere, whatever its node is called.
    return graph_.services().contains(key) && !claims_.claimed(service_gid(key.first));
  };
  for (auto it = services_.begin(); it != services_.end();) {
    Service& service = (it++)->second;
    if (!is_real(service.key)) remove(service, now);
  }
  for (const auto& [key, state] : graph_.services()) {
    if (!is_real(key)) continue;
    const auto [it, is_new] = services_.try_emplace(key);
    Service& service = it->second;
    if (is_new) {
      service.key = key;
      service.results = is_result_service(key.first);
      if (service.results) service.queue = ServerQueue(kResultSilenceMax);
    }
    update_servers(service, state, now);
  }
}

// The peer has used up its call numbers; the calls of others go on.
void ServiceExports::renew(Served& served, const Now& now) {
  Service& service = *served.service;
  end(served, now);
  service.links.erase(LinkId(served.link));
  release_client(service);
  offers_due_ = true;
}

void ServiceExports::remove(Service& service, const Now& now) {
  end_line(service);
  for (auto& [id, served] : service.links) end(served, now);
  service.links.clear();
  release_client(service);
  services_.erase(ServiceKey(service.key));
}

std::optional<Decision> ServiceExports::permission(const Link& link, const ServiceKey& key) const {
  const auto wire_name = options_.names.to_wire(key.first);
  if (!wire_name) return std::nullopt;
  const auto action_type = actions_.type_of(InterfaceKind::kService, key.first, key.second);
  if (!action_type) return std::nullopt;  // it is not whole
  const Interface what{InterfaceKind::kService, *wire_name, key.second, *action_type};
  auto decision = policy_.decide(Direction::kExport, what, link.identity);
  // Between two connections what the peer accepts is not known; our own rules hold at once.
  if (!decision || (link.accepts && !accepted_by(*link.accepts, what))) return std::nullopt;
  return decision;
}

QueueOptions ServiceExports::queue_options(const Served& served) const {
  QueueOptions queue;
  queue.priority = served.decision.treatment.priority.value_or(Priority::kHigh);
  queue.keep = true;
  return queue;
}

void ServiceExports::recheck(Link& link, const Now& now) {
  for (auto& [key, service] : services_) {
    const auto it = service.links.find(link.id);
    if (it == service.links.end()) continue;
    Served& served = it->second;
    const auto decision = permission(link, key);
    if (!decision) {
      end(served, now);
      service.links.erase(it);
      release_client(service);
      continue;
    }
    served.decision = *decision;
    if (served.channel)
      link.connection->outbox().add_channel(served.channel, queue_options(served));
    else
      served.considered = false;
  }
}

void ServiceExports::collect_offers(Link& link, std::vector<ChannelOffer>& offers, const Now& now) {
  for (auto& [key, service] : services_) {
    if (service.failed) continue;
    Served& served = service.links[link.id];
    if (served.considered) continue;
    served.service = &service;
    served.link = link.id;
    served.considered = true;
    auto decision = permission(link, key);
    if (!decision) {
      if (served.held) let_go(served, now);  // a rule was changed while the link was lost
      continue;
    }
    served.decision = std::move(*decision);
    offers.push_back(open_channel(served, link));
    if (!served.held) continue;
    served.forgotten_at = TimerKey{now.steady + kAttachTime, ++last_timer_};
    timers_[*served.forgotten_at] = {&served, CallId{}};
  }
}

ChannelOffer ServiceExports::open_channel(Served& served, Link& link) {
  const auto& [name, type] = served.service->key;
  if (served.epoch == 0) served.epoch = static_cast<std::uint32_t>(1 + random_.below(UINT32_MAX));
  served.channel = {++link.last_channel};
  by_channel_[{link.id, served.channel}] = &served;
  link.connection->outbox().add_channel(served.channel, queue_options(served));
  ChannelOffer offer;
  offer.channel = served.channel;
  offer.kind = InterfaceKind::kService;
  offer.name = options_.names.to_wire(name).value_or(name);
  offer.type = type;
  offer.action_type = actions_.type_of(offer.kind, name, type).value_or("");
  offer.priority = queue_options(served).priority;
  const std::string& node = served.service->node;
  offer.node = options_.names.to_wire(node).value_or(node);
  offer.epoch = served.epoch;
  return offer;
}

void ServiceExports::end(Served& served, const Now& now) {
  end_calls(served, now);
  const auto link = links_.find(served.link);
  if (served.requests) {
    // Requests may be on their way: they are expected until the peer says that none follow.
    by_requests_[{served.link, served.requests}] = nullptr;
    ++load_of(served).ended_channels;
  }
  if (served.channel) {
    by_channel_.erase({served.link, served.channel});
    if (link != links_.end() && link->second.connection) {
      link->second.connection->outbox().remove_channel(served.channel);
      link->second.send(Withdraw{{served.channel}});
    }
  }
  served.channel = served.requests = {};
  served.held = served.attached = false;
}

void ServiceExports::let_go(Served& served, const Now& now) {
  end_calls(served, now);
  served.requests = {};
  served.held = served.attached = false;
  release_client(*served.service);
}

void ServiceExports::end_calls(Served& served, const Now& now) {
  if (served.forgotten_at) timers_.erase(*std::exchange(served.forgotten_at, {}));
  served.counts.lost += served.calls.size();
  while (!served.calls.empty()) erase(served, served.calls.begin());
  if (served.hungry) std::erase(load_of(served).hungry, &served);
  served.hungry = false;
  resume(served, now);  // others get its places
}

void ServiceExports::on_link_lost(LinkId id) {
  for (auto it = by_channel_.lower_bound({id, ChannelId{}});
       it != by_channel_.end() && it->first.first == id;)
    it = by_channel_.erase(it);
  for (auto it = by_requests_.lower_bound({id, ChannelId{}});
       it != by_requests_.end() && it->first.first == id;)
    it = by_requests_.erase(it);
  for (auto& [key, service] : services_) {
    const auto it = service.links.find(id);
    if (it == service.links.end()) continue;
    if (it->second.forgotten_at) timers_.erase(*std::exchange(it->second.forgotten_at, {}));
    it->second.considered = it->second.attached = false;
    it->second.channel = it->second.requests = {};
    if (!it->second.held && it->second.calls.empty()) service.links.erase(it);
  }
  loads_[id].ended_channels = 0;
}

void ServiceExports::on_link_dead(LinkId id, const Now& now) {
  const auto load = loads_.find(id);
  if (load != loads_.end()) {  // the places that get free are for nobody
    for (Served* served : load->second.hungry) served->hungry = false;
    load->second.hungry.clear();
  }
  for (auto& [key, service] : services_) {
    const auto it = service.links.find(id);
    if (it == service.links.end()) continue;
    end(it->second, now);
    service.links.erase(it);
    release_client(service);
  }
  std::erase_if(by_requests_, [&](const auto& entry) { return entry.first.first == id; });
  loads_.erase(id);
}

Result<Nothing> ServiceExports::on_attach(Link& link, const Attach& attach, const Now& now) {
  if (link.expects(attach.requests))
    return Error{CloseCode::kIllegal, "a channel of requests has a number that is in use"};
  const auto it = by_channel_.find({link.id, attach.channel});
  if (it == by_channel_.end()) {
    if (attach.channel.value > link.last_channel)
      return Error{CloseCode::kUnknownChannel, "attached to a service that was never offered"};
    // It crossed our withdraw, and the peer will end it as soon as it sees that.
    if (++loads_[link.id].ended_channels > kEndedChannelsMax)
      return Error{CloseCode::kTooLarge, "too many channels of requests are not ended"};
    link.expect(attach.requests, nullptr);
    by_requests_[{link.id, attach.requests}] = nullptr;
    return Nothing{};
  }
  Served& served = *it->second;
  if (served.requests) return Error{CloseCode::kIllegal, "attached to a service twice"};
  PeerLoad& load = loads_[link.id];
  load.attaches_paid_until = std::max(load.attaches_paid_until, now.steady) + kAttachPeriod;
  if (load.ended_channels > kEndedChannelsMax ||
      load.attaches_paid_until - now.steady > kAttachesAtOnce * kAttachPeriod)
    return Error{CloseCode::kTooLarge, "services are attached and ended too often"};
  link.expect(attach.requests, nullptr);
  if (served.forgotten_at) timers_.erase(*std::exchange(served.forgotten_at, {}));
  served.requests = attach.requests;
  served.held = true;
  by_requests_[{link.id, attach.requests}] = &served;
  use_client(*served.service);
  if (served.service->ready) send_attached(served, link, now);
  return Nothing{};
}

bool ServiceExports::on_withdraw(Link& link, ChannelId requests, const Now& now) {
  const auto it = by_requests_.find({link.id, requests});
  if (it == by_requests_.end()) return false;
  Served* served = it->second;
  by_requests_.erase(it);
  link.forget(requests);
  if (!served) {
    --loads_[link.id].ended_channels;
    return true;
  }
  let_go(*served, now);
  link.connection->outbox().clear_channel(served->channel);
  return true;
}

void ServiceExports::send_attached(Served& served, Link& link, const Now& now) {
  served.attached = true;
  Attached attached{served.channel, served.requests, served.seen, {}, served.service->type_hash};
  for (const auto& [id, call] : served.calls) attached.calls.push_back(id);
  link.send(attached);
  push_answers(served, now);
}

bool ServiceExports::on_decline(Link& link, const Decline& decline, const Now& now) {
  const auto it = by_channel_.find({link.id, decline.channel});
  if (it == by_channel_.end()) return false;
  Served& served = *it->second;
  if (!link.note_decline(served.counts.declined, decline, now)) return true;
  outputs_.log(LogLevel::kWarn, link.label() + " does not import " + served.service->key.first +
                                    ": " + decline.reason + " (" + decline.code + ")");
  return true;
}

void ServiceExports::on_client_failed(const ServiceClientFailed& failed, const Now& now) {
  const auto it = by_client_.find(failed.client);
  if (it == by_client_.end()) return;
  Service& service = *it->second;
  by_client_.erase(it);
  outputs_.log(LogLevel::kError, "cannot call " + service.key.first + ": " + failed.reason);
  service.client = {};
  service.failed = true;
  note_action_use(service, false);
  end_line(service);
  for (auto& [id, served] : service.links) end(served, now);
  service.links.clear();
}

void ServiceExports::add_status(const Link& link, LinkStatus& status) const {
  for (const auto& [key, service] : services_) {
    const auto it = service.links.find(link.id);
    if (it == service.links.end() || !it->second.channel) continue;
    const Served& served = it->second;
    ServiceStatus s = served.counts;
    s.service = key.first;
    s.type = key.second;
    s.exported = true;
    s.attached = served.attached;
    if (served.requests) s.declined.clear();  // not any more
    s.pending = static_cast<std::uint32_t>(served.calls.size());
    s.waiting = static_cast<std::uint32_t>(served.waiting.size() + (served.in_line ? 1 : 0));
    status.services.push_back(std::move(s));
  }
}

std::uint64_t ServiceExports::memory_bytes() const {
  std::uint64_t bytes = 0;
  for (const auto& [id, load] : loads_) bytes += load.request_bytes + load.answer_bytes;
  return bytes;
}

}  // namespace connect_bridge
