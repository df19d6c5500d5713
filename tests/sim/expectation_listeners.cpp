// What the subscriptions of one side must be by those of the other.
#include <algorithm>
#include <set>

#include "sim/expectation.hpp"

namespace connect_bridge::sim {

using namespace std::chrono_literals;
namespace {

using Topics = std::set<std::pair<std::string, std::string>>;  // name, type

// A reader of the importer's graph, as the exporter is told of it.
void expect(const Reader& reader, const Host& importer, const Host& exporter,
            const Ledger::Peer& peer, const Middleware& middleware, Topics& listened) {
  const EndpointSpec& spec = reader.spec;
  const auto wire = importer.plan().names.to_wire(spec.topic);
  if (spec.graph != importer.graph() || !wire) return;
  const Names& there = exporter.plan().names;
  const std::string local = there.to_local(*wire);
  if (there.to_wire(local) != *wire || !is_ordinary(local)) return;
  if (!middleware.knows_type(exporter.graph(), spec.type)) return;
  const bool exported =
      is_permitted(exporter.policy(), Direction::kExport, *wire, spec.type, peer.seen_as);
  const bool imported =
      is_permitted(importer.policy(), Direction::kImport, *wire, spec.type, peer.sees_us);
  if (!exported || !imported) return;
  listened.emplace(local, spec.type);
}

}  // namespace

// Larger ones do not wait for their mirror (core/mirrors/first_messages.hpp).
constexpr std::size_t kSmall = 32 << 10;
// Until it leaves: the origin is told, its type's definition asked for and told, and the demand
// told, in up to six crossings of up to 200 ms each.
constexpr Duration kFirstTakes = 1500ms;

void Expectation::check_first_words() const {
  for (const auto& expected : mirrors_) {
    const auto& speakers = crowd_.speakers();
    const Writer& origin = middleware_.writer(expected.origin);
    if (std::find(speakers.begin(), speakers.end(), origin.id) == speakers.end()) continue;
    if (!is_complete(expected) || expected.ways > 1) continue;
    if (crowd_.plan_of(origin.id).bytes_max > kSmall) continue;
    if (expected.qos.lifespan < kFirstTakes) continue;  // by a rule
    // They speak at once, and a queue holds what a rule says of all publishers of a topic together,
    // as a DDS reader does (DDS 1.4 section 2.2.3.18); a link holds so many bytes of all topics.
    std::uint64_t of_topic = 0, topic_bytes = 0, bytes = 0;
    for (const int speaker : speakers) {
      const EndpointSpec& other = middleware_.writer(speaker).spec;
      if (other.graph != origin.spec.graph) continue;
      bytes += crowd_.plan_of(speaker).bytes_max;
      if (other.topic != origin.spec.topic) continue;
      topic_bytes += crowd_.plan_of(speaker).bytes_max;
      ++of_topic;
    }
    if (expected.qos.depth < of_topic || expected.link_bytes_max < bytes) continue;
    if (expected.topic_bytes_max > 0 && expected.topic_bytes_max < topic_bytes) continue;
    for (const int id : crowd_.readers()) {
      if (!hears(middleware_.reader(id).spec, expected)) continue;
      checker_.ledger().coverage().count(Judged::kFirstWords);
      const auto& received = checker_.deliveries().received(id, origin.id);
      if (received.size() == 1) continue;
      violated("the first message of publisher " + std::to_string(origin.id) + " of " +
               origin.spec.topic + " reached subscriber " + std::to_string(id) + " " +
               std::to_string(received.size()) + " times");
    }
  }
}

void Expectation::check_listeners() const {
  for (const auto& host : hosts_) {
    Topics expected;
    bool in_one_graph = false;
    for (const auto& peer : checker_.ledger().peers_of(*host)) {
      in_one_graph = in_one_graph || peer.host->graph() == host->graph();
      for (const int id : peer.host->running() ? crowd_.readers() : std::vector<int>{})
        expect(middleware_.reader(id), *peer.host, *host, peer, middleware_, expected);
    }
    if (in_one_graph || !host->running()) continue;
    Topics found;
    for (const auto& [id, subscription] : host->subscriptions())
      if (is_ordinary(subscription.made.topic))
        found.emplace(subscription.made.topic, subscription.made.type);
    checker_.ledger().coverage().count(Judged::kListeners, expected.size());
    for (const auto& [name, type] : expected)
      if (!found.contains({name, type}))
        violated(describe(*host) + " does not subscribe to " + name +
                 ", which somebody at the other side listens to");
    for (const auto& [name, type] : found)
      if (!expected.contains({name, type}))
        violated(describe(*host) + " subscribes to " + name + " for nobody");
  }
}

}  // namespace connect_bridge::sim
