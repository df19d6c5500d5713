#include "sim/delivery_check.hpp"

#include <string>

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

// Until a sample is taken, attributed to its publisher and sent.
constexpr Duration kTaken = 300ms;

std::string name_of(const Label& label) {
  return "message " + std::to_string(label.counter) + " of publisher " +
         std::to_string(label.writer);
}

}  // namespace

std::string describe(const Host& host) {
  return "side " + std::to_string(host.index());
}

void DeliveryCheck::on_publish(const Host& host, const Host::MirrorInfo& mirror, ByteView message) {
  const std::string& topic = mirror.made.topic;
  if (!is_ordinary(topic)) return;
  ++published_;
  const auto label = read_label(message);
  if (!label) violated(describe(host) + " publishes on " + topic + " what nobody published");
  if (!is_intact(message)) violated(name_of(*label) + " is damaged at " + describe(host));
  if (ledger_.published(static_cast<int>(label->writer)) < label->counter || label->counter == 0) {
    violated(name_of(*label) + " was never published");
  }
  const int origin = static_cast<int>(label->writer);
  const auto [it, first] = by_mirror_.try_emplace(mirror.writer, Last{origin, 0});
  if (it->second.origin != origin) {
    violated("a mirror on " + topic + " publishes for two origins, " +
             std::to_string(it->second.origin) + " and " + std::to_string(origin));
  }
  if (label->counter <= it->second.counter) {
    violated(name_of(*label) + " is published at " + describe(host) + " after message " +
             std::to_string(it->second.counter) + " on " + topic);
  }
  it->second.counter = label->counter;
  by_mirrors_[{host.graph(), origin}].insert(label->counter);
  check_source(host, mirror, *label);
  if (ledger_.steady()) check_late(host, mirror, *label);
}

// What does not resume (commands) comes on the connection that was there when it was published, or
// not at all.
void DeliveryCheck::check_late(const Host& host, const Host::MirrorInfo& mirror,
                               const Label& label) const {
  const Writer& origin = ledger_.middleware().writer(static_cast<int>(label.writer));
  const std::string& type = origin.spec.type;
  if (origin.spec.qos.durability == Durability::kTransientLocal) return;  // they come again
  for (const auto& peer : ledger_.peers_of(host)) {
    const auto wire = peer.host->plan().names.to_wire(origin.spec.topic);
    if (!wire || !peer.host->running()) continue;
    const auto exported =
        treatment_of(peer.host->policy(), Direction::kExport, *wire, type, peer.sees_us);
    const auto imported =
        treatment_of(host.policy(), Direction::kImport, *wire, type, peer.seen_as);
    if (!exported || !imported) continue;
    if (resumes(*exported, *wire, type) && resumes(*imported, mirror.made.topic, type)) return;
    ledger_.coverage().count(Judged::kCommands);
    const TimePoint published = ledger_.published_at(origin.id, label.counter);
    if (published + kTaken >= peer.host->last_open()) return;
    violated(name_of(label) + " of " + origin.spec.topic +
             " does not resume, and is published at " + describe(host) +
             " although the connection was opened only after it");
  }
}

// Somebody with whom the host is linked must be allowed to export it, and the host to import it.
void DeliveryCheck::check_source(const Host& host, const Host::MirrorInfo& mirror,
                                 const Label& label) const {
  const Writer& origin = ledger_.middleware().writer(static_cast<int>(label.writer));
  const std::string& topic = mirror.made.topic;
  if (origin.spec.graph == host.graph()) {
    violated(name_of(label) + " comes back to its own graph at " + describe(host));
  }
  if (origin.spec.host >= 0) violated(name_of(label) + " is no origin but a mirror");
  if (origin.spec.type != mirror.made.type) violated(name_of(label) + " changed its type");
  const TimePoint since = ledger_.published_at(origin.id, label.counter);
  bool named = false;
  bool imported = false;
  bool exported = false;
  for (const auto& peer : ledger_.peers_of(host)) {
    if (peer.host->graph() != origin.spec.graph) continue;
    const auto wire = peer.host->plan().names.to_wire(origin.spec.topic);
    if (!wire || host.plan().names.to_local(*wire) != topic) continue;
    named = true;
    const auto treatment =
        treatment_of(host.policy(), Direction::kImport, *wire, origin.spec.type, peer.seen_as);
    if (!treatment) continue;
    imported = true;
    if (!ledger_.was_permitted(*peer.host, since, Direction::kExport, InterfaceKind::kTopic, *wire,
                               origin.spec.type, peer.sees_us)) {
      continue;
    }
    exported = true;
    if (is_young(host, label, *treatment)) return;
  }
  const std::string what = exported   ? " beyond its max_age"
                           : imported ? " without a right to export it"
                           : named    ? " without a right to import it"
                                      : " under a wrong name";
  violated(name_of(label) + " of " + origin.spec.topic + " is published on " + topic + " at " +
           describe(host) + what);
}

// A rule's max_age holds at the importer as exactly as the two clocks are known to each other.
bool DeliveryCheck::is_young(const Host& host, const Label& label,
                             const Treatment& treatment) const {
  if (treatment.max_age == kForever || ledger_.clock_steps()) return true;
  const int origin = static_cast<int>(label.writer);
  const Duration age = ledger_.now() - ledger_.published_at(origin, label.counter);
  Duration bound = treatment.max_age + 5ms;
  bool known = false;
  for (const auto& link : host.status().links) {
    if (!link.clock.known) continue;
    known = true;
    bound = std::max(bound, treatment.max_age + link.clock.error_bound + 5ms);
  }
  return !known || age <= bound;
}

void DeliveryCheck::on_delivery(const Reader& reader, const Writer& mirror, const Sample& sample) {
  if (mirror.spec.host < 0 || !is_ordinary(mirror.spec.topic)) return;
  const auto label = read_label(sample.payload.view());
  if (!label) violated("a subscriber got something that nobody published");
  ++delivered_;
  const int origin = static_cast<int>(label->writer);
  auto& last = by_match_[{reader.id, mirror.id}];
  if (label->counter <= last) {
    violated(name_of(*label) + " reached subscriber " + std::to_string(reader.id) + " of " +
             reader.spec.topic + (label->counter == last ? " twice" : " out of order"));
  }
  last = label->counter;
  received_[{reader.id, origin}].push_back(label->counter);
  // A new mirror tells a new subscriber the history again; nothing else may come again.
  auto& newest = newest_[{reader.id, origin}];
  const bool latched =
      ledger_.middleware().writer(origin).spec.qos.durability == Durability::kTransientLocal;
  if (!latched && !overlaps_ && label->counter <= newest) {
    violated(name_of(*label) + " reached subscriber " + std::to_string(reader.id) + " of " +
             reader.spec.topic + " again through another mirror");
  }
  newest = std::max(newest, label->counter);
}

DeliveryCheck::Missing DeliveryCheck::missing(int reader, int origin) const {
  Missing result;
  const auto& counters = received(reader, origin);
  if (counters.empty()) return result;
  const std::set<std::uint64_t> arrived(counters.begin(), counters.end());
  const auto& published = by_mirrors_.at({ledger_.middleware().reader(reader).spec.graph, origin});
  for (auto n = *arrived.begin(); n < *arrived.rbegin(); ++n)
    if (!arrived.contains(n)) ++(published.contains(n) ? result.published : result.unpublished);
  return result;
}

void DeliveryCheck::forget() {
  const auto& writers = ledger_.middleware().writers();
  const auto& readers = ledger_.middleware().readers();
  const auto is_gone = [&](const auto& entry) {
    return !readers.knows(entry.first.first) || !writers.knows(entry.first.second);
  };
  std::erase_if(by_mirror_, [&](const auto& entry) { return !writers.knows(entry.first); });
  std::erase_if(by_match_, is_gone);
  std::erase_if(received_, is_gone);
  std::erase_if(newest_, is_gone);
  std::erase_if(by_mirrors_, [&](const auto& entry) { return !writers.knows(entry.first.second); });
  for (auto& [key, counters] : received_)
    std::erase_if(counters,
                  [&, origin = key.second](auto n) { return ledger_.has_forgotten(origin, n); });
  for (auto& [key, counters] : by_mirrors_)
    std::erase_if(counters,
                  [&, origin = key.second](auto n) { return ledger_.has_forgotten(origin, n); });
}

std::optional<int> DeliveryCheck::origin_of(int mirror_writer) const {
  const auto it = by_mirror_.find(mirror_writer);
  if (it == by_mirror_.end()) return {};
  return it->second.origin;
}

const std::vector<std::uint64_t>& DeliveryCheck::received(int reader, int origin) const {
  static const std::vector<std::uint64_t> kNone;
  const auto it = received_.find({reader, origin});
  return it == received_.end() ? kNone : it->second;
}

}  // namespace connect_bridge::sim
