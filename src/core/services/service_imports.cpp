// Which services of peers exist here, and which link feeds each. Calls are in
// service_imports_calls.cpp.
#include "core/services/service_imports.hpp"

#include <algorithm>

#include "core/link/options.hpp"
#include "core/policy/interface.hpp"
#include "core/services/service_exports.hpp"

namespace connect_bridge {
namespace {

// Before a mirror takes calls, other bridges of this graph have this long to say that they mirror
// the same service: two servers of one name would both execute each call.
constexpr Duration kSettle = std::chrono::milliseconds(150);
// After a start the local graph is still being discovered.
constexpr Duration kDiscovery = std::chrono::milliseconds(500);

}  // namespace

ServiceImports::ServiceImports(const SideOptions& options, const Policy& policy,
                               const GraphView& graph, const Claims& claims, LinkTable& links,
                               Jobs& jobs, Outputs& outputs)
    : options_(options),
      policy_(policy),
      graph_(graph),
      claims_(claims),
      links_(links),
      jobs_of_encoders_(jobs),
      outputs_(outputs) {}

ServiceImports::~ServiceImports() = default;

void ServiceImports::on_offer(Link& link, const ChannelOffer& offer, const Now& now) {
  const auto no = [&](const std::string& code, const std::string& reason) {
    decline(link, offer.channel, code, reason);
  };
  if (!is_canonical_name(offer.name) || !is_service_type(offer.type))
    return no("not_permitted", "the name or type is not canonical");
  auto decision = policy_.decide(
      Direction::kImport, {InterfaceKind::kService, offer.name, offer.type, offer.action_type},
      link.identity);
  if (!decision) return no("not_permitted", "no rule allows importing " + offer.name);
  if (options_.names.to_wire(options_.names.to_local(offer.name)) != offer.name)
    return no("not_permitted", "another name is mapped to its name here");
  const ServiceKey key{options_.names.to_local(offer.name), offer.type};
  Import& import = imports_[key];
  import.key = key;
  import.results = is_result_service(key.first);
  Feed& feed = import.feeds[link.id];
  if (feed.channel) return no("failed", "this service is offered twice");
  if (import.feeder == link.id && feed.epoch != offer.epoch) destroy_mirror(import);
  if (import.feeds.size() > 1)
    tell_once(LogLevel::kWarn, "several links offer " + key.first + ": one of them is called");
  feed.imports = this;
  feed.import = &import;
  feed.link = link.id;
  feed.channel = offer.channel;
  feed.epoch = offer.epoch;
  feed.node = offer.node;
  feed.action_type = offer.action_type;
  feed.decision = std::move(*decision);
  channels_[{link.id, offer.channel}] = &feed;
  import.failed = false;
  update(import, now);
}

void ServiceImports::decline(Link& link, ChannelId channel, const std::string& code,
                             const std::string& reason) {
  channels_[{link.id, channel}] = nullptr;
  link.send(Decline{channel, code, reason});
}

std::optional<Decision> ServiceImports::permission(const Link& link, const Feed& feed) const {
  const auto wire_name = options_.names.to_wire(feed.import->key.first);
  if (!wire_name) return std::nullopt;
  return policy_.decide(
      Direction::kImport,
      {InterfaceKind::kService, *wire_name, feed.import->key.second, feed.action_type},
      link.identity);
}

ServiceImports::Feed* ServiceImports::feeding(Import& import) {
  const auto it = import.feeds.find(import.feeder);
  return it == import.feeds.end() ? nullptr : &it->second;
}

void ServiceImports::update(Import& import, const Now& now) {
  if (import.feeds.empty()) {
    destroy_mirror(import);
    imports_.erase(ServiceKey(import.key));
    return;
  }
  if (!feeding(import)) {
    const auto open = std::find_if(import.feeds.begin(), import.feeds.end(),
                                   [](const auto& feed) { return bool(feed.second.channel); });
    import.feeder = (open == import.feeds.end() ? import.feeds.begin() : open)->first;
  }
  Feed& feed = *feeding(import);
  if (!may_exist(import, feed)) return close(import);
  if (feed.channel && !feed.requests) attach(import, feed, now);
  if (!feed.attached || import.mirror || !import.mirror_at) return;
  if (*import.mirror_at <= now.steady) return create_mirror(import, feed);
  settles_at_ = settles_at_ ? std::min(*settles_at_, *import.mirror_at) : *import.mirror_at;
}

bool ServiceImports::may_exist(const Import& import, const Feed& feed) {
  if (!graph_since_ || import.failed) return false;
  const Gid gid = service_gid(import.key.first);
  if (claims_.taken(gid)) return false;
  // Our own parameters are not in our picture of the graph.
  if (node_of_parameter_service(import.key.first, import.key.second) == options_.node) return false;
  // Both ends are in one graph: what the peer exports is here already.
  const auto& connection = links_.at(feed.link).connection;
  if (connection && claims_.is_here(connection->peer().side)) return false;
  if (!graph_.has_server(import.key.first) || claims_.claimed(gid)) return true;
  tell_once(LogLevel::kWarn, import.key.first + " has a server here and one behind " +
                                 links_.at(feed.link).label() + ": the one there is not mirrored");
  return false;
}

void ServiceImports::attach(Import& import, Feed& feed, const Now& now) {
  Link& link = links_.at(feed.link);
  feed.requests = {++link.last_channel};
  by_requests_[{feed.link, feed.requests}] = &feed;
  QueueOptions queue;
  queue.priority = feed.decision.treatment.priority.value_or(Priority::kHigh);
  queue.keep = true;
  link.connection->outbox().add_channel(feed.requests, queue);
  if (!feed.encoder || feed.encoder->bytes() == 0) start_encoder(feed);
  link.send(Attach{feed.channel, feed.requests});
  if (import.mirror_at) return;
  // Claimed from now on, so that of two bridges only one makes a mirror.
  const Duration settle = graph_.bridges().empty() ? Duration::zero() : kSettle;
  import.mirror_at = std::max(now.steady + settle, *graph_since_ + kDiscovery);
  claim_changed_ = true;
}

void ServiceImports::start_encoder(Feed& feed) {
  feed.encoder.reset();
  Encoder::Options options;
  options.how = feed.decision.treatment.compression;
  if (options.how.codec == Codec::kNone) return;
  options.queue_bytes_max = UINT64_MAX;  // no_room() bounds what comes here
  feed.encoder.emplace(options, jobs_of_encoders_, feed);
}

void ServiceImports::send_encoded(Feed& feed, const Now& now) {
  while (const auto ready = feed.encoder->next())
    encoded(feed, ready->sample.subject.call(), ready->codec, ready->sample.raw, ready->body, now);
}

void ServiceImports::create_mirror(Import& import, const Feed& feed) {
  import.mirror = outputs_.new_service_mirror();
  by_mirror_[import.mirror] = &import;
  std::string node;
  if (options_.proxy_nodes && is_canonical_name(feed.node))
    node = options_.names.to_local(feed.node);
  outputs_.push(CreateServiceMirror{import.mirror, import.key.first, import.key.second,
                                    feed.type_hash, std::move(node)});
}

void ServiceImports::close(Import& import) {
  if (Feed* feed = feeding(import); feed && feed->requests) {
    Link& link = links_.at(feed->link);
    by_requests_.erase({feed->link, feed->requests});
    if (link.connection) link.connection->outbox().remove_channel(feed->requests);
    link.send(Withdraw{{feed->requests}});
    feed->requests = {};
    feed->attached = false;
  }
  destroy_mirror(import);
}

void ServiceImports::destroy_mirror(Import& import) {
  if (Feed* feed = feeding(import)) end_calls(*feed);
  if (import.mirror_at) claim_changed_ = true;
  import.mirror_at.reset();
  if (!import.mirror) return;
  outputs_.push(DestroyServiceMirror{import.mirror});
  by_mirror_.erase(import.mirror);
  import.mirror = {};
}

void ServiceImports::remove_feed(Import& import, LinkId link) {
  Feed& feed = import.feeds.at(link);
  if (import.feeder == link) {
    close(import);
    import.feeder = {};
  }
  if (feed.channel) channels_.erase({link, feed.channel});
  import.feeds.erase(link);
}

bool ServiceImports::on_withdraw(Link& link, ChannelId channel, const Now& now) {
  const auto it = channels_.find({link.id, channel});
  if (it == channels_.end()) return false;
  Feed* feed = it->second;
  channels_.erase(it);
  if (!feed) return true;
  Import& import = *feed->import;
  remove_feed(import, link.id);
  update(import, now);
  return true;
}

Result<Nothing> ServiceImports::on_attached(Link& link, const Attached& attached, const Now& now) {
  const auto it = channels_.find({link.id, attached.channel});
  if (it == channels_.end())
    return Error{CloseCode::kUnknownChannel, "attached to a service that does not exist"};
  Feed* feed = it->second;
  // The answer to an attachment that has ended meanwhile.
  if (!feed || feed->requests != attached.requests) return Nothing{};
  if (feed->attached) return Error{CloseCode::kIllegal, "attached twice"};
  if (attached.seen.value >= kCallNumbersMax)
    return Error{CloseCode::kIllegal, "more calls seen than can be made"};
  feed->attached = true;
  feed->type_hash = attached.type_hash;
  reconcile(*feed, attached, now);
  update(*feed->import, now);
  return Nothing{};
}

void ServiceImports::on_link_lost(LinkId link) {
  const auto of_link = [&](const auto& entry) { return entry.first.first == link; };
  for (auto it = channels_.lower_bound({link, ChannelId{}}); it != channels_.end() && of_link(*it);
       it = channels_.erase(it)) {
    if (!it->second) continue;
    it->second->channel = it->second->requests = {};
    it->second->attached = false;
  }
  for (auto it = by_requests_.lower_bound({link, ChannelId{}});
       it != by_requests_.end() && of_link(*it);)
    it = by_requests_.erase(it);
}

void ServiceImports::forget_orphans(LinkId link, const Now& now) {
  for (auto it = imports_.begin(); it != imports_.end();) {
    Import& import = (it++)->second;
    const auto feed = import.feeds.find(link);
    if (feed == import.feeds.end() || feed->second.channel) continue;
    remove_feed(import, link);
    update(import, now);
  }
}

void ServiceImports::on_link_dead(LinkId link, const Now& now) {
  for (auto it = imports_.begin(); it != imports_.end();) {
    Import& import = (it++)->second;
    if (!import.feeds.contains(link)) continue;
    remove_feed(import, link);
    update(import, now);
  }
  loads_.erase(link);
}

void ServiceImports::on_graph(const Now& now) {
  if (!graph_since_) graph_since_ = now.steady;
  for (auto it = imports_.begin(); it != imports_.end();) update((it++)->second, now);
}

void ServiceImports::on_claims(const Now& now) {
  for (auto it = imports_.begin(); it != imports_.end();) update((it++)->second, now);
}

void ServiceImports::on_policy(const Now& now) {
  for (auto it = imports_.begin(); it != imports_.end();) {
    Import& import = (it++)->second;
    for (auto at = import.feeds.begin(); at != import.feeds.end();) {
      Feed& feed = (at++)->second;
      Link& link = links_.at(feed.link);
      if (auto decision = permission(link, feed)) {
        feed.decision = std::move(*decision);
        continue;
      }
      const ChannelId channel = feed.channel;
      remove_feed(import, link.id);
      if (channel)
        decline(link, channel, "not_permitted", "no rule allows importing it any longer");
    }
    update(import, now);
  }
}

void ServiceImports::on_mirror_failed(const ServiceMirrorFailed& failed) {
  const auto it = by_mirror_.find(failed.mirror);
  if (it == by_mirror_.end()) return;
  Import& import = *it->second;
  by_mirror_.erase(it);
  import.mirror = {};
  import.failed = true;
  tell_once(LogLevel::kError, "cannot mirror " + import.key.first + ": " + failed.reason);
  if (const Feed* feed = feeding(import); feed && feed->channel)
    links_.at(feed->link).send(Decline{feed->channel, failed.code, failed.reason});
  close(import);
}

// A peer can make these happen as often as it likes.
void ServiceImports::tell_once(LogLevel level, const std::string& text) {
  constexpr std::size_t kToldMax = 1024;
  if (told_.size() < kToldMax && told_.insert(text).second) outputs_.log(level, text);
}

void ServiceImports::add_mirrored(std::vector<Gid>& claim) const {
  for (const auto& [key, import] : imports_)
    if (import.mirror_at) claim.push_back(service_gid(key.first));
}

void ServiceImports::add_status(const Link& link, LinkStatus& status) const {
  for (const auto& [key, import] : imports_) {
    const auto it = import.feeds.find(link.id);
    if (it == import.feeds.end()) continue;
    ServiceStatus s = it->second.counts;
    s.service = key.first;
    s.type = key.second;
    s.attached = it->second.attached && import.mirror;
    s.pending = static_cast<std::uint32_t>(it->second.calls.size());
    status.services.push_back(std::move(s));
  }
}

std::uint64_t ServiceImports::memory_bytes() const {
  std::uint64_t bytes = 0;
  for (const auto& [id, load] : loads_) bytes += load.request_bytes + load.decoding_bytes;
  return bytes;
}

}  // namespace connect_bridge
