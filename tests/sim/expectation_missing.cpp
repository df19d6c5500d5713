// What a side says does not cross, by the rules of both sides.
#include <algorithm>

#include "sim/expectation.hpp"

namespace connect_bridge::sim {

using namespace std::chrono_literals;
namespace {

// A link that is open for so long has been looked at, and what was found has lasted.
constexpr Duration kSaid = 25s;

// Null: it is not clear which of them it is.
const Ledger::Peer* peer_of(const std::vector<Ledger::Peer>& peers, const LinkStatus& link) {
  const Ledger::Peer* found = nullptr;
  for (const auto& peer : peers) {
    if (peer.seen_as.name != link.identity) continue;
    if (found) return nullptr;
    found = &peer;
  }
  return found;
}

}  // namespace

bool Expectation::is_wanted_alone(const Reader& reader) const {
  if (!reader.alive || reader.spec.host >= 0 || !is_ordinary(reader.spec.topic)) return false;
  if (reader.spec.topic.find("/_") != std::string::npos) return false;  // hidden
  return !middleware_.writers().any([&](const Writer& writer) {
    const EndpointSpec& spec = writer.spec;
    return writer.alive && spec.graph == reader.spec.graph && spec.topic == reader.spec.topic &&
           spec.type == reader.spec.type;
  });
}

void Expectation::check_missing() const {
  for (const auto& host : hosts_) {
    if (!host->running()) continue;
    const auto peers = checker_.ledger().peers_of(*host);
    for (const auto& link : host->status().links) {
      const Ledger::Peer* peer = peer_of(peers, link);
      if (!peer || !peer->host->running() || !link.open || link.open_for < kSaid) continue;
      for (const MissingName& missing : link.missing) check_missing(*host, *peer, missing);
      if (link.further_missing > 0) continue;
      for (const int id : crowd_.readers()) {
        const Reader& reader = middleware_.reader(id);
        const EndpointSpec& spec = reader.spec;
        const auto wire = host->plan().names.to_wire(spec.topic);
        if (spec.graph != host->graph() || !wire || !is_wanted_alone(reader)) continue;
        if (is_permitted(host->policy(), Direction::kImport, *wire, spec.type, peer->seen_as))
          continue;
        const bool said = std::any_of(
            link.missing.begin(), link.missing.end(),
            [&](const MissingName& m) { return m.name == spec.topic && m.type == spec.type; });
        // Another link may bring it.
        if (!said && peers.size() == 1)
          violated(describe(*host) + " does not say why " + spec.topic + " does not come");
      }
    }
  }
}

void Expectation::check_missing(const Host& host, const Ledger::Peer& peer,
                                const MissingName& missing) const {
  const auto wire = host.plan().names.to_wire(missing.name);
  if (missing.kind != InterfaceKind::kTopic || !wire || !is_ordinary(missing.name)) return;
  checker_.ledger().coverage().count(Judged::kMissing);
  const bool ours =
      is_permitted(host.policy(), missing.exported ? Direction::kExport : Direction::kImport, *wire,
                   missing.type, peer.seen_as);
  const bool theirs =
      is_permitted(peer.host->policy(), missing.exported ? Direction::kImport : Direction::kExport,
                   *wire, missing.type, peer.sees_us);
  const auto lies = [&] {
    violated(describe(host) + " says of " + missing.name + " what is not so: " + missing.text);
  };
  switch (missing.reason) {
    case MissingReason::kNoRule:
    case MissingReason::kOtherPeer:
    case MissingReason::kDenied:
    case MissingReason::kRuleType:
      if (ours) lies();
      break;
    case MissingReason::kNotGiven:
    case MissingReason::kNotTaken:
      if (theirs || !ours) lies();
      break;
    case MissingReason::kNotThere:
      if (!theirs || !ours) lies();
      break;
    case MissingReason::kOtherType:
    case MissingReason::kTypeUnknown:
    case MissingReason::kDeclined:
    case MissingReason::kOutside:
    case MissingReason::kQos:
    case MissingReason::kLost: break;
  }
}

}  // namespace connect_bridge::sim
