#include "sim/middleware.hpp"

#include <algorithm>
#include <map>
#include <tuple>

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

bool same_topic(const EndpointSpec& a, const EndpointSpec& b) {
  return a.graph == b.graph && a.topic == b.topic && a.type == b.type;
}

}  // namespace

bool compatible(const Qos& offered, const Qos& requested) {
  if (requested.reliability == Reliability::kReliable &&
      offered.reliability == Reliability::kBestEffort) {
    return false;
  }
  if (requested.durability == Durability::kTransientLocal &&
      offered.durability == Durability::kVolatile) {
    return false;
  }
  if (offered.deadline > requested.deadline) return false;
  if (offered.liveliness < requested.liveliness) return false;
  return offered.liveliness_lease <= requested.liveliness_lease;
}

Middleware::Middleware(Schedule& schedule, std::vector<GraphPlan> graphs, Rng rng,
                       Listener& listener)
    : schedule_(schedule),
      graphs_(std::move(graphs)),
      rng_(rng),
      listener_(listener),
      losses_(graphs_.size()) {}

// As in DDS, the endpoints of a process share the first 12 bytes; ordinary nodes are processes of
// their own.
Gid Middleware::new_gid(const EndpointSpec& spec) {
  std::string node = std::to_string(spec.graph) + " " + std::to_string(spec.host);
  if (spec.host < 0) node += " " + spec.node_namespace + "/" + spec.node_name;
  const auto [it, is_new] = participants_.try_emplace(node);
  it->second.used = schedule_.now();
  it->second.bridge = spec.host >= 0;
  Gid& gid = it->second.gid;
  const bool alike = !is_new && graphs_[index(spec.graph)].ids_show_process;
  for (std::size_t i = alike ? 12 : 0; i < 16; ++i) {
    gid.bytes[i] = static_cast<std::uint8_t>(rng_.next());
  }
  return gid;
}

void Middleware::meet(int host, int other, TimePoint when) {
  meetings_[std::minmax(host, other)] = when;
  schedule_.at(when, [this, host] {
    for (const auto& writer : writers_)
      if (writer.spec.host == host) return listener_.on_graph_change(writer.spec.graph);
  });
}

TimePoint Middleware::meeting(int host, int other) const {
  const auto it = meetings_.find(std::minmax(host, other));
  return it == meetings_.end() ? TimePoint{} : it->second;
}

void Middleware::announce(const EndpointSpec& spec) {
  listener_.on_graph_change(spec.graph);
  const Duration delay = graphs_[index(spec.graph)].name_delay;
  if (delay > 0ns) {
    schedule_.after(delay, [this, graph = spec.graph] { listener_.on_graph_change(graph); });
  }
}

std::optional<TypeLack> Middleware::lack_of(int graph, const std::string& type) const {
  if (knows_type(graph, type)) return std::nullopt;
  return TypeLack{"type_unknown", "the type " + type + " is not known here"};
}

bool Middleware::knows_type(int graph, const std::string& type) const {
  const auto& unknown = graphs_[index(graph)].unknown_types;
  return std::find(unknown.begin(), unknown.end(), type) == unknown.end();
}

Stamp Middleware::stamp(int graph) const {
  return graphs_[index(graph)].clock.at(schedule_.now());
}

void Middleware::calm() {
  for (auto& graph : graphs_) graph.loss_permille = 0;
}

int Middleware::create_writer(EndpointSpec spec) {
  Writer& writer = writers_.add();
  writer.spec = std::move(spec);
  writer.gid = new_gid(writer.spec);
  writer.created = schedule_.now();
  for (const auto& reader : readers_) plan_match(writer, reader);
  announce(writer.spec);
  return writer.id;
}

int Middleware::create_reader(EndpointSpec spec) {
  Reader& reader = readers_.add();
  reader.spec = std::move(spec);
  reader.gid = new_gid(reader.spec);
  reader.created = schedule_.now();
  for (const auto& writer : writers_) plan_match(writer, reader);
  announce(reader.spec);
  return reader.id;
}

void Middleware::destroy_writer(int id) {
  Writer& writer = writers_[id];
  if (!writer.alive) return;
  writer.alive = false;
  writer.destroyed = schedule_.now();
  writer.history.clear();
  writer.matches.clear();
  listener_.on_graph_change(writer.spec.graph);
}

void Middleware::destroy_reader(int id) {
  Reader& reader = readers_[id];
  if (!reader.alive) return;
  reader.alive = false;
  reader.destroyed = schedule_.now();
  listener_.on_graph_change(reader.spec.graph);
}

void Middleware::forget(TimePoint before) {
  writers_.forget(before);
  readers_.forget(before);
  std::erase_if(participants_, [before](const auto& participant) {
    return !participant.second.bridge && participant.second.used < before;
  });
}

void Middleware::plan_match(const Writer& writer, const Reader& reader) {
  if (!writer.alive || !reader.alive || !same_topic(writer.spec, reader.spec)) return;
  if (same_process(writer.spec, reader.spec)) return;
  if (!compatible(writer.spec.qos, reader.spec.qos)) return;
  const Duration delay = rng_.between(1us, graphs_[index(writer.spec.graph)].discovery_max);
  const TimePoint met = meeting(writer.spec.host, reader.spec.host);
  schedule_.at(std::max(schedule_.now(), met) + delay, [this, w = writer.id, r = reader.id] {
    if (writers_[w].alive && readers_[r].alive) {
      match(writers_[w], readers_[r]);
    }
  });
}

void Middleware::match(Writer& writer, const Reader& reader) {
  Writer::Match& made = writer.matches.emplace_back(Writer::Match{reader.id, schedule_.now()});
  if (writer.spec.qos.durability != Durability::kTransientLocal ||
      reader.spec.qos.durability != Durability::kTransientLocal) {
    return;
  }
  const Duration lifespan = writer.spec.qos.lifespan;
  for (const auto& sample : writer.history) {
    if (lifespan == kForever || schedule_.now() - sample.published <= lifespan) {
      deliver(writer, made, sample);
    }
  }
}

void Middleware::publish(int id, Payload payload) {
  Writer& writer = writers_[id];
  if (!writer.alive) violated("published on a publisher that does not exist");
  ++writer.count;
  if (writer.spec.host < 0) ++published_;
  // No two are alike; but a clock that is set back takes the stamps with it.
  const Stamp now = stamp(writer.spec.graph);
  writer.last_stamp = now == writer.last_stamp ? now + 1 : now;
  Sample sample{std::move(payload), writer.last_stamp, writer.count, schedule_.now()};
  auto& matches = writer.matches;
  std::erase_if(matches, [this](const auto& m) { return !readers_[m.reader].alive; });
  for (auto& made : matches) deliver(writer, made, sample);
  if (writer.spec.qos.durability != Durability::kTransientLocal) return;
  writer.history.push_back(std::move(sample));
  const std::uint32_t depth = std::max(1U, writer.spec.qos.depth);
  if (writer.spec.qos.history == History::kKeepLast && writer.history.size() > depth) {
    writer.history.pop_front();
  }
}

void Middleware::deliver(const Writer& writer, Writer::Match& made, const Sample& sample) {
  const Reader& reader = readers_[made.reader];
  const bool reliable = reader.spec.qos.reliability == Reliability::kReliable;
  if (!reliable && rng_.chance(graphs_[index(reader.spec.graph)].loss_permille)) {
    ++losses_[index(reader.spec.graph)];
    return;
  }
  made.last_delivery =
      std::max(made.last_delivery, schedule_.now() + rng_.between(Duration{20us}, 300us));
  schedule_.at(made.last_delivery, [this, r = made.reader, w = writer.id, sample] {
    if (readers_[r].alive) {
      listener_.on_delivery(readers_[r], writers_[w], sample);
    }
  });
}

GraphChanged Middleware::snapshot(int graph, int host) const {
  std::map<std::tuple<std::string, std::string, std::string>, TopicState> topics;
  const bool tells_depth = graphs_[index(graph)].tells_depth;
  const Duration name_delay = graphs_[index(graph)].name_delay;
  const auto add = [&](const auto& endpoint, auto member) {
    const EndpointSpec& spec = endpoint.spec;
    if (!endpoint.alive || spec.graph != graph || spec.host == host) return;
    if (schedule_.now() < meeting(spec.host, host)) return;
    TopicState& topic = topics[{spec.topic, spec.type, spec.type_hash}];
    Endpoint seen{endpoint.gid, spec.node_namespace, spec.node_name, spec.qos};
    if (!tells_depth) seen.qos.depth = 0;
    if (schedule_.now() < endpoint.created + name_delay) {
      seen.node_name = "_NODE_NAME_UNKNOWN_";
      seen.node_namespace = "_NODE_NAMESPACE_UNKNOWN_";
    }
    (topic.*member).push_back(std::move(seen));
  };
  for (const auto& writer : writers_) add(writer, &TopicState::publishers);
  for (const auto& reader : readers_) add(reader, &TopicState::subscribers);
  GraphChanged result;
  for (auto& [key, topic] : topics) {
    std::tie(topic.name, topic.type, topic.type_hash) = key;
    topic.lack = lack_of(graph, topic.type);
    result.topics.push_back(std::move(topic));
  }
  return result;
}

}  // namespace connect_bridge::sim
