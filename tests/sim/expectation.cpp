#include "sim/expectation.hpp"

#include <algorithm>
#include <bit>

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

// What a mirror keeps of an origin that keeps all.
constexpr std::uint32_t kMirrorDepthMax = 1'000;

Qos overridden(Qos qos, const QosOverride& by) {
  if (by.reliability) qos.reliability = *by.reliability;
  if (by.durability) qos.durability = *by.durability;
  if (by.depth) {
    qos.depth = *by.depth;
    qos.history = History::kKeepLast;
  }
  return qos;
}

bool may_drop(const Treatment& treatment) {
  return treatment.max_rate > 0 || treatment.bytes_per_second_max > 0 ||
         treatment.max_age != kForever;
}

}  // namespace

Expectation::Expectation(const Middleware& middleware, Checker& checker, const Crowd& crowd,
                         const std::vector<std::unique_ptr<Host>>& hosts, bool rules_change)
    : middleware_(middleware),
      checker_(checker),
      crowd_(crowd),
      hosts_(hosts),
      rules_change_(rules_change) {}

void Expectation::settle() {
  mirrors_.clear();
  for (const int id : crowd_.writers()) {
    for (const auto& host : hosts_) expect_origin(middleware_.writer(id), *host);
  }
}

void Expectation::expect_origin(const Writer& origin, const Host& importer) {
  const EndpointSpec& spec = origin.spec;
  if (importer.graph() == spec.graph || !importer.running()) return;
  if (!middleware_.knows_type(importer.graph(), spec.type)) return;
  if (!middleware_.knows_type(spec.graph, spec.type)) return;  // it is not offered
  for (const auto& peer : checker_.ledger().peers_of(importer)) {
    const Host& exporter = *peer.host;
    if (exporter.graph() != spec.graph || !exporter.running()) continue;
    const auto wire = exporter.plan().names.to_wire(spec.topic);
    if (!wire) continue;
    const auto exported =
        treatment_of(exporter.policy(), Direction::kExport, *wire, spec.type, peer.sees_us);
    const auto imported =
        treatment_of(importer.policy(), Direction::kImport, *wire, spec.type, peer.seen_as);
    if (!exported || !imported) continue;
    ExpectedMirror expected;
    // With several ways, the mirror may still be as a way of the old rules had it.
    expected.certain = !rules_change_ || checker_.ledger().pairs().size() == 1;
    expected.graph = importer.graph();
    expected.topic = importer.plan().names.to_local(*wire);
    expected.type = spec.type;
    expected.origin = origin.id;
    Qos told = spec.qos;
    if (!middleware_.graph(spec.graph).tells_depth) told.depth = 0;
    expected.qos = overridden(overridden(told, exported->qos), imported->qos);
    const SideOptions& there = importer.plan().options;
    if (expected.qos.depth == 0) {
      expected.qos.depth = expected.qos.durability == Durability::kTransientLocal
                               ? there.latched_depth
                               : there.default_depth;
    }
    if (expected.qos.history == History::kKeepAll) {
      expected.qos.history = History::kKeepLast;
      expected.qos.depth = kMirrorDepthMax;
    }
    const SideOptions& here = exporter.plan().options;
    expected.history = told.depth == 0 ? here.latched_depth : told.depth;
    expected.made_volatile = exported->qos.durability == Durability::kVolatile;
    expected.limited = may_drop(*exported) || may_drop(*imported);
    expected.resumes = resumes(*exported, *wire, spec.type) &&
                       resumes(*imported, expected.topic, spec.type) &&
                       expected.qos.reliability == Reliability::kReliable &&
                       spec.qos.durability == Durability::kVolatile;
    expected.bytes_max =
        std::min<std::uint64_t>(there.reassembly.message_bytes_max, here.outbox.data_bytes_max / 3);
    expected.queue_bytes_max =
        std::min<std::uint64_t>(here.outbox.data_bytes_max / 2, here.history_bytes_max);
    expected.topic_bytes_max = exported->queue_bytes_max;
    expected.link_bytes_max = here.outbox.data_bytes_max;
    merge(std::move(expected));
  }
}

// An origin that several pairs of sides can carry has one mirror all the same.
void Expectation::merge(ExpectedMirror expected) {
  for (auto& known : mirrors_) {
    if (known.graph != expected.graph || known.origin != expected.origin) continue;
    known.certain = known.certain && known.qos == expected.qos && known.topic == expected.topic;
    known.limited = known.limited || expected.limited;
    known.bytes_max = std::min(known.bytes_max, expected.bytes_max);
    ++known.ways;
    known.history = std::min(known.history, expected.history);
    known.queue_bytes_max = std::min(known.queue_bytes_max, expected.queue_bytes_max);
    return;
  }
  mirrors_.push_back(std::move(expected));
}

bool Expectation::hears(const EndpointSpec& reader, const ExpectedMirror& expected) {
  return reader.graph == expected.graph && reader.topic == expected.topic &&
         reader.type == expected.type && compatible(expected.qos, reader.qos);
}

bool Expectation::is_complete(const ExpectedMirror& expected) const {
  return expected.certain && !expected.limited &&
         crowd_.plan_of(expected.origin).bytes_max <= expected.bytes_max;
}

void Expectation::check_links() const {
  for (const auto& pair : checker_.ledger().pairs()) {
    const auto is_open = [](const Host& at, const Host& peer) {
      const auto links = at.status().links;
      return std::count_if(links.begin(), links.end(), [&](const auto& link) {
        return link.open && link.node == peer.plan().options.node;
      });
    };
    const auto there = is_open(*pair.server, *pair.client);
    const auto here = is_open(*pair.client, *pair.server);
    const auto should = pair.may_log_in ? 1 : 0;
    if (there != should || here != should) {
      violated("after the network has healed " + describe(*pair.client) + " has " +
               std::to_string(here) + " and " + describe(*pair.server) + " has " +
               std::to_string(there) + " open links, expected " + std::to_string(should) + ": " +
               pair.client->status().last_failure.text);
    }
  }
}

void Expectation::check_mirrors() const {
  using Key = std::pair<int, std::pair<std::string, std::string>>;
  std::map<Key, int> expected;
  std::map<Key, int> found;
  for (const auto& mirror : mirrors_) {
    const Key key{mirror.graph, {mirror.topic, mirror.type}};
    ++expected[key];
  }
  for (const auto& host : hosts_) {
    for (const auto& [id, mirror] : host->mirrors()) {
      const std::string& topic = mirror.made.topic;
      if (!is_ordinary(topic)) continue;
      ++found[{host->graph(), {topic, mirror.made.type}}];
    }
  }
  for (const auto& [key, count] : expected) found.try_emplace(key, 0);
  for (const auto& [key, count] : found) {
    const auto it = expected.find(key);
    const int should = it == expected.end() ? 0 : it->second;
    if (count != should) {
      violated("graph " + std::to_string(key.first) + " has " + std::to_string(count) +
               " mirrors of " + key.second.first + ", expected " + std::to_string(should));
    }
  }
}

// The middleware keeps the last samples of transient-local mirrors within the peer's memory: what
// is kept counts three times, and a mirror may take an eighth of the rest
// (core/topics/import_context.cpp). Half of it is left to queues here.
bool Expectation::may_keep_fewer(const ExpectedMirror& expected) const {
  std::uint64_t kept = 0;
  for (const auto& other : mirrors_) {
    if (other.graph != expected.graph || other.qos.durability != Durability::kTransientLocal)
      continue;
    kept += std::uint64_t{other.qos.depth} * crowd_.plan_of(other.origin).bytes_max;
  }
  return std::any_of(hosts_.begin(), hosts_.end(), [&](const auto& host) {
    return host->graph() == expected.graph &&
           (3 + 8) * kept > host->plan().options.account.memory_bytes_max / 2;
  });
}

bool Expectation::is_as_expected(const Qos& made, const ExpectedMirror& expected) const {
  if (made == expected.qos) return true;
  Qos fewer = expected.qos;
  fewer.depth = made.depth;
  return made == fewer && made.depth < expected.qos.depth && std::has_single_bit(made.depth) &&
         may_keep_fewer(expected);
}

void Expectation::check_qos() const {
  for (const auto& host : hosts_) {
    for (const auto& [id, mirror] : host->mirrors()) {
      const auto origin = checker_.deliveries().origin_of(mirror.writer);
      for (const auto& expected : mirrors_) {
        if (!origin || expected.origin != *origin || expected.graph != host->graph()) continue;
        if (expected.certain && !is_as_expected(mirror.made.qos, expected)) {
          violated("the mirror of publisher " + std::to_string(*origin) + " on " + expected.topic +
                   " has another QoS than its origin");
        }
        const EndpointSpec& spec = middleware_.writer(*origin).spec;
        const std::string node =
            host->plan().options.proxy_nodes
                ? host->plan().names.to_local(spec.node_namespace + "/" + spec.node_name)
                : "";
        if (mirror.made.node != node) {
          violated("the mirror of publisher " + std::to_string(*origin) + " belongs to node '" +
                   mirror.made.node + "' and not to '" + node + "'");
        }
      }
    }
  }
}

// ---- rounds of messages
// ------------------------------------------------------------------------------

std::map<std::string, Expectation::Counts> Expectation::count_topics() const {
  std::map<std::string, Counts> result;
  for (const auto& pair : checker_.ledger().pairs()) {
    for (const auto& [from, to] :
         {std::pair{pair.client, pair.server}, {pair.server, pair.client}}) {
      for (const auto& link : from->status().links) {
        for (const auto& topic : link.topics) {
          if (!topic.exported || !topic.demanded) continue;
          const auto wire = from->plan().names.to_wire(topic.topic);
          Counts& counts = result[std::to_string(from->index()) + " " + topic.topic + " " +
                                  topic.type + " " + to->plan().names.to_local(wire.value_or(""))];
          counts.taken = checker_.taken(*from, topic.topic, topic.type);
          counts.handled = topic.messages + topic.dropped.total() + topic.queued;
          counts.sent = topic.messages;
          for (const auto& back : to->status().links) {
            for (const auto& other : back.topics) {
              if (other.exported || other.type != topic.type || !wire ||
                  other.topic != to->plan().names.to_local(*wire)) {
                continue;
              }
              // What is too large is not sent; the peer has told how many.
              counts.arrived = other.messages + other.dropped.total() + other.queued -
                               other.dropped.of(DropReason::kTooLarge);
            }
          }
        }
      }
    }
  }
  return result;
}

void Expectation::begin_rounds() {
  for (const int writer : crowd_.writers()) {
    published_before_[writer] = checker_.ledger().published(writer);
  }
  writers_before_ = middleware_.writers().made();
  if (checker_.ledger().pairs().size() == 1) counts_before_ = count_topics();
}

void Expectation::check_rounds() const {
  if (checker_.ledger().pairs().size() == 1) {
    const auto after = count_topics();
    for (const auto& [topic, before] : counts_before_) {
      const auto it = after.find(topic);
      if (it == after.end()) continue;
      const Counts& now = it->second;
      if (now.taken - before.taken != now.handled - before.handled) {
        violated("topic " + topic + ": " + std::to_string(now.taken - before.taken) +
                 " samples taken, but sent, dropped and queued make " +
                 std::to_string(now.handled - before.handled));
      }
      if (now.sent - before.sent != now.arrived - before.arrived) {
        violated("topic " + topic + ": " + std::to_string(now.sent - before.sent) +
                 " messages sent, but published and dropped at the peer make " +
                 std::to_string(now.arrived - before.arrived));
      }
    }
  }
  for (const auto& expected : mirrors_) {
    for (const int id : crowd_.readers()) check_reader(expected, middleware_.reader(id));
  }
}

void Expectation::check_reader(const ExpectedMirror& expected, const Reader& reader) const {
  const EndpointSpec& spec = reader.spec;
  if (spec.graph != expected.graph || spec.topic != expected.topic || spec.type != expected.type) {
    return;
  }
  if (!is_complete(expected) || !compatible(expected.qos, spec.qos)) return;
  const Writer& origin = middleware_.writer(expected.origin);
  const auto& received = checker_.deliveries().received(reader.id, origin.id);
  for (auto n = published_before_.at(origin.id) + 1; n <= origin.count; ++n) {
    checker_.ledger().coverage().count(Judged::kQuiet);
    const auto times = std::count(received.begin(), received.end(), n);
    // A mirror that is made again for fewer samples tells them once more.
    const bool is_again =
        times > 1 && may_keep_fewer(expected) && was_mirrored_again(expected, writers_before_);
    if (times == 1 || is_again) continue;
    violated("message " + std::to_string(n) + " of publisher " + std::to_string(origin.id) +
             " of " + origin.spec.topic + ", published when all was quiet, reached subscriber " +
             std::to_string(reader.id) + " " + std::to_string(times) + " times");
  }
}

}  // namespace connect_bridge::sim
