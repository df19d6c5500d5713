#include "sim/checker.hpp"

#include <algorithm>
#include <cstdlib>
#include <string>

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

// A drifting clock moves on while the best sample of the estimate grows old.
constexpr std::int64_t kSampleAgeSeconds = 30;

constexpr Duration kMirrorLingers = 300ms;

}  // namespace

void Checker::on_start(const Host& host) {
  ledger_.note_policy(host);
  std::erase_if(taken_, [&](const auto& t) { return t.first.first == host.index(); });
  last_dial_.erase(host.index());
}

void Checker::on_end(const Host& host) {
  wire_.on_end(host);
  calls_.on_end(host);
}

void Checker::on_policy(const Host& host) {
  ledger_.note_policy(host);
  policy_changed_.insert(host.index());
  policy_changed_at_[host.index()] = ledger_.now();
}

// A new policy holds at once: no subscription survives it without a right. A mirror may stay for a
// moment, so that the middleware can deliver its last samples; nothing is published on it any more.
void Checker::after_input(const Host& host) {
  if (policy_changed_.erase(host.index()) == 0) return;
  for (const auto& [id, subscription] : host.subscriptions()) {
    check_export(host, subscription.made.topic, subscription.made.type);
  }
  for (const auto& [id, mirror] : host.service_mirrors()) on_service_mirror(host, mirror.made);
  for (const auto& [id, client] : host.service_clients()) on_service_client(host, client.made);
}

void Checker::on_mirror(const Host& host, const Host::MirrorInfo& mirror) {
  check_import(host, mirror.made.topic, mirror.made.type);
}

void Checker::on_subscription(const Host& host, const CreateSubscription& made) {
  check_export(host, made.topic, made.type);
}

void Checker::on_service_mirror(const Host& host, const CreateServiceMirror& made) {
  check_service(host, Direction::kImport, made.service, made.type);
  for (const auto& [id, client] : host.service_clients()) {
    if (client.made.service == made.service && client.made.type == made.type) {
      violated(describe(host) + " both mirrors and calls " + made.service);
    }
  }
}

void Checker::on_service_client(const Host& host, const CreateServiceClient& made) {
  check_service(host, Direction::kExport, made.service, made.type);
}

void Checker::check_service(const Host& host, Direction direction, const std::string& service,
                            const std::string& type) const {
  const auto wire = host.plan().names.to_wire(service);
  const auto peers = ledger_.peers_of(host);
  if (wire && is_hostile(*wire) && host.meets_strangers()) return;
  const bool permitted =
      wire && std::any_of(peers.begin(), peers.end(), [&](const auto& peer) {
        return service_treatment_of(host.policy(), direction, *wire, type, peer.seen_as)
            .has_value();
      });
  if (!permitted) violated(describe(host) + " has to do with " + service + " without a right");
}

void Checker::check_import(const Host& host, const std::string& topic,
                           const std::string& type) const {
  if (is_claims(topic) || (is_hostile(topic) && host.meets_strangers())) return;
  if (is_clock(topic) && host.plan().options.clock_publish_period > 0ns) return;
  const auto wire = host.plan().names.to_wire(topic);
  const auto peers = ledger_.peers_of(host);
  const bool permitted =
      wire && std::any_of(peers.begin(), peers.end(), [&](const auto& peer) {
        return is_permitted(host.policy(), Direction::kImport, *wire, type, peer.seen_as);
      });
  if (!permitted) violated(describe(host) + " mirrors " + topic + " without a right");
}

void Checker::check_export(const Host& host, const std::string& topic,
                           const std::string& type) const {
  if (is_claims(topic) || (is_hostile(topic) && host.meets_strangers())) return;
  const auto wire = host.plan().names.to_wire(topic);
  const auto peers = ledger_.peers_of(host);
  const bool permitted =
      wire && std::any_of(peers.begin(), peers.end(), [&](const auto& peer) {
        return is_permitted(host.policy(), Direction::kExport, *wire, type, peer.seen_as);
      });
  if (!permitted) violated(describe(host) + " subscribes to " + topic + " without a right");
}

void Checker::on_taken(const Host& host, const Reader& reader, const Writer& writer,
                       const Sample& sample) {
  ++taken_[{host.index(), {reader.spec.topic, reader.spec.type}}];
  if (!is_claims(reader.spec.topic)) wire_.on_taken(host, reader, writer, sample);
}

std::uint64_t Checker::taken(const Host& host, const std::string& topic,
                             const std::string& type) const {
  const auto it = taken_.find({host.index(), {topic, type}});
  return it == taken_.end() ? 0 : it->second;
}

void Checker::on_dial(const Host& host) {
  const auto it = last_dial_.find(host.index());
  const Duration least = host.plan().options.retry_min / 2;
  const bool may_hurry = host.last_network_change() == ledger_.now();
  if (it != last_dial_.end() && ledger_.now() - it->second < least && !may_hurry) {
    violated(describe(host) + " dials again without waiting");
  }
  last_dial_[host.index()] = ledger_.now();
}

void Checker::on_close(const Host& host, const CloseConnection& action) {
  ++closes_[action.code];
  // Honest sides never close each other's connections with these codes.
  const bool fault = action.code == CloseCode::kMalformed || action.code == CloseCode::kIllegal ||
                     action.code == CloseCode::kUnknownChannel ||
                     action.code == CloseCode::kTooLarge || action.code == CloseCode::kInternal ||
                     action.code == CloseCode::kVersion || action.code == CloseCode::kSameSide;
  if (fault && !host.meets_strangers()) {
    violated(describe(host) + " blames an honest peer: " + action.reason);
  }
}

void Checker::inspect(const Host& host) {
  if (!host.running() || host.stopped()) return;
  const Status status = host.status();
  const auto changed = policy_changed_at_.find(host.index());
  if (changed == policy_changed_at_.end() || changed->second + kMirrorLingers < ledger_.now()) {
    for (const auto& [id, mirror] : host.mirrors()) {
      check_import(host, mirror.made.topic, mirror.made.type);
    }
  }
  calls_.inspect(host);
  check_memory(host, status);
  check_clock(host, status);
  check_silence(host);
  wire_.on_status(host, status);
}

// Every queue has its budget, and what the side holds of our bytes is within their sum.
void Checker::check_memory(const Host& host, const Status& status) const {
  const SideOptions& options = host.plan().options;
  constexpr std::uint64_t kEncoders = 4 << 20;
  const std::uint64_t one = options.reassembly.message_bytes_max;
  const std::uint64_t calls = 2 * options.call_bytes_max;  // requests, and responses
  std::uint64_t bound = options.history_bytes_max + kEncoders + one;
  for (const auto& link : status.links) {
    const std::uint64_t queued_max =
        std::max<std::uint64_t>(options.outbox.data_bytes_max, one) + calls;
    if (link.queued_bytes > queued_max) {
      violated(describe(host) + " queues " + std::to_string(link.queued_bytes) + " of " +
               std::to_string(queued_max) + " bytes");
    }
    if (link.unacknowledged_bytes > options.outbox.unacknowledged_bytes_max + 128 * 1024) {
      violated(describe(host) + " sent more than its window without an acknowledgement");
    }
    bound += queued_max + calls + options.reassembly.open_bytes_max + options.resume_bytes_max;
  }
  // What is always allowed: one message and some texts of each link.
  const std::uint64_t shared =
      options.account.memory_bytes_max + status.links.size() * (one + 65536);
  if (status.shared_bytes > shared) {
    violated(describe(host) + " makes its peers hold " + std::to_string(status.shared_bytes) +
             " bytes, bound " + std::to_string(shared));
  }
  if (status.memory_bytes > bound) {
    violated(describe(host) + " tells of " + std::to_string(status.memory_bytes) +
             " bytes, bound " + std::to_string(bound));
  }
  if (host.held_bytes() > 2 * bound) {
    violated(describe(host) + " holds " + std::to_string(host.held_bytes()) + " bytes, bound " +
             std::to_string(2 * bound));
  }
}

void Checker::check_clock(const Host& host, const Status& status) const {
  if (ledger_.clock_steps()) return;
  const auto& middleware = ledger_.middleware();
  for (const auto& link : status.links) {
    if (!link.open || !link.clock.known) continue;
    for (const auto& peer : ledger_.peers_of(host)) {
      if (peer.host->plan().options.node != link.node) continue;
      const MachineClock& theirs = middleware.graph(peer.host->graph()).clock;
      const MachineClock& ours = middleware.graph(host.graph()).clock;
      const Stamp truth = theirs.at(ledger_.now()) - ours.at(ledger_.now());
      const Stamp drift =
          kSampleAgeSeconds * (std::abs(theirs.drift_ppb) + std::abs(ours.drift_ppb));
      const Stamp error = std::abs(truth - link.clock.offset.count());
      ledger_.coverage().count(Judged::kClocks);
      if (error > link.clock.error_bound.count() + drift + 1000) {
        violated("the clock offset at " + describe(host) + " is wrong by " + std::to_string(error) +
                 " ns, beyond its bound of " + std::to_string(link.clock.error_bound.count()));
      }
    }
  }
}

// Whether the rules of a host say of a topic that it may come late, for any peer.
bool Checker::may_resume(const Host& host, const CreateSubscription& made) const {
  if (!is_ordinary(made.topic)) return true;
  const auto wire = host.plan().names.to_wire(made.topic);
  const auto peers = ledger_.peers_of(host);
  return wire && std::any_of(peers.begin(), peers.end(), [&](const auto& peer) {
           const auto treatment =
               treatment_of(host.policy(), Direction::kExport, *wire, made.type, peer.seen_as);
           return treatment && resumes(*treatment, *wire, made.type);
         });
}

// When nothing was heard for dead_after, nothing of the peer remains but the subscriptions of what
// is kept for its return.
void Checker::check_silence(const Host& host) const {
  const TimePoint heard = std::max(host.last_packet(), host.last_open());
  const TimePoint end = heard + host.plan().options.dead_after + 200ms;
  if (ledger_.now() < end) return;
  const bool forgotten = ledger_.now() >= end + host.plan().options.resume_for;
  const auto is_kept = [&](const CreateSubscription& made) {
    return !forgotten && made.qos.reliability == Reliability::kReliable &&
           made.qos.durability == Durability::kVolatile && may_resume(host, made);
  };
  for (const auto& [id, mirror] : host.mirrors()) {
    if (is_claims(mirror.made.topic)) continue;
    violated("a mirror of " + mirror.made.topic + " outlives its dead link at " + describe(host));
  }
  for (const auto& [id, subscription] : host.subscriptions()) {
    if (is_claims(subscription.made.topic) || is_kept(subscription.made)) continue;
    violated(describe(host) + " still subscribes to " + subscription.made.topic +
             " for a dead link");
  }
  for (const auto& [id, mirror] : host.service_mirrors()) {
    violated("a mirror of service " + mirror.made.service + " outlives its dead link at " +
             describe(host));
  }
  for (const auto& [id, client] : host.service_clients()) {
    violated(describe(host) + " is still a client of " + client.made.service + " for a dead link");
  }
}

}  // namespace connect_bridge::sim
