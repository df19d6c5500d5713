#include "sim/crowd.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "sim/label.hpp"

namespace connect_bridge::sim {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kTopicEndpointsMax = 40, kOfADayMax = 20;

}  // namespace

Crowd::Crowd(Schedule& schedule, Middleware& middleware, Ledger& ledger, const Scenario& scenario,
             Rng rng, bool verbose)
    : schedule_(schedule),
      middleware_(middleware),
      ledger_(ledger),
      scenario_(scenario),
      rng_(rng),
      verbose_(verbose),
      endpoints_max_(scenario.day ? kOfADayMax : kTopicEndpointsMax) {}

std::string Crowd::local_name(int graph, const TopicPlan& topic) const {
  for (const auto& host : scenario_.hosts) {
    if (host.graph == graph) return host.names.to_local(topic.name);
  }
  return topic.name;
}

void Crowd::tell(const std::string& what, int id, bool writer) const {
  const EndpointSpec& spec = writer ? middleware_.writer(id).spec : middleware_.reader(id).spec;
  const Qos& qos = spec.qos;
  std::printf("%9.4f graph %d %s: %s, %s, %s, depth %u, lifespan %.3g s\n",
              seconds(schedule_.now()), spec.graph, what.c_str(), spec.topic.c_str(),
              qos.reliability == Reliability::kReliable ? "reliable" : "best effort",
              qos.durability == Durability::kVolatile ? "volatile" : "transient local", qos.depth,
              qos.lifespan == kForever ? 0 : seconds(qos.lifespan));
}

const TopicPlan& Crowd::plan_of(int writer) const {
  return *plan_of_writer_.at(writer);
}

Qos Crowd::writer_qos(const TopicPlan& topic) {
  Qos qos;
  if (topic.lasting) {
    qos.depth = 20;
    return qos;
  }
  const bool latched = topic.mixed ? rng_.chance(500) : topic.latched;
  qos.durability = latched ? Durability::kTransientLocal : Durability::kVolatile;
  qos.reliability = rng_.chance(750) ? Reliability::kReliable : Reliability::kBestEffort;
  if (scenario_.steady) qos.reliability = Reliability::kReliable;
  qos.depth = static_cast<std::uint32_t>(rng_.chance(300) ? 1 : rng_.between(1, 20));
  if (!latched && rng_.chance(60)) qos.history = History::kKeepAll;
  if (rng_.chance(100)) qos.lifespan = rng_.between(100ms, 1500ms);
  if (rng_.chance(50)) qos.deadline = rng_.between(500ms, 2s);
  if (rng_.chance(50)) {
    qos.liveliness = Liveliness::kManualByTopic;
    qos.liveliness_lease = rng_.between(1s, 3s);
  }
  return qos;
}

Qos Crowd::reader_qos(const TopicPlan& topic) {
  Qos qos;
  if (topic.latched && rng_.chance(700)) qos.durability = Durability::kTransientLocal;
  qos.reliability = rng_.chance(500) ? Reliability::kReliable : Reliability::kBestEffort;
  qos.depth = static_cast<std::uint32_t>(rng_.between(1, 20));
  if (rng_.chance(40)) qos.deadline = rng_.between(1s, 3s);
  if (rng_.chance(30)) qos.liveliness = Liveliness::kManualByTopic;
  return qos;
}

EndpointSpec Crowd::spec(const TopicPlan& topic, int graph, const std::string& node,
                         const Qos& qos) {
  EndpointSpec spec;
  spec.graph = graph;
  spec.topic = local_name(graph, topic);
  // Where names have a prefix, something may also live outside of it.
  if (spec.topic != topic.name && rng_.chance(100)) spec.topic = topic.name;
  spec.type = topic.type;
  spec.type_hash = topic.type_hash;
  spec.node_namespace = "/app";
  spec.node_name = node;
  spec.qos = qos;
  return spec;
}

int Crowd::add_writer(const TopicPlan& topic, int graph, const std::string& node) {
  const int id = create_writer(topic, graph, node, writer_qos(topic));
  schedule_.after(rng_.between(0ms, topic.period), [this, id] { tick(id); });
  return id;
}

int Crowd::create_writer(const TopicPlan& topic, int graph, const std::string& node,
                         const Qos& qos) {
  const int id = middleware_.create_writer(spec(topic, graph, node, qos));
  plan_of_writer_[id] = &topic;
  writers_.push_back(id);
  if (verbose_) tell("publisher " + std::to_string(id), id, true);
  return id;
}

int Crowd::add_reader(int graph, const std::string& topic, const TopicPlan& plan, const Qos& qos) {
  EndpointSpec made = spec(plan, graph, "reader" + std::to_string(++last_node_), qos);
  made.topic = topic;
  const int id = middleware_.create_reader(std::move(made));
  readers_.push_back(id);
  return id;
}

void Crowd::add_random_reader() {
  const TopicPlan& topic = rng_.pick(scenario_.topics);
  const int graph = static_cast<int>(rng_.below(scenario_.graphs.size()));
  const int id = middleware_.create_reader(
      spec(topic, graph, "reader" + std::to_string(++last_node_), reader_qos(topic)));
  readers_.push_back(id);
  if (verbose_) tell("subscriber " + std::to_string(id), id, false);
}

void Crowd::add_speakers() {
  Qos qos;
  qos.depth = 10;
  for (const auto& topic : scenario_.topics) {
    if (topic.latched || topic.mixed) continue;  // beside transient-local ones late samples end
    for (const int graph : topic.graphs) {
      const int id = create_writer(topic, graph, "speaker" + std::to_string(++last_node_), qos);
      speakers_.push_back(id);
      const Duration found = middleware_.graph(graph).discovery_max + 1ms;
      schedule_.after(found, [this, id] { publish(id); });
    }
  }
}

void Crowd::add_lasting(const TopicPlan& topic) {
  for (const int graph : topic.graphs) {
    lasting_writers_.insert(add_writer(topic, graph, "writer" + std::to_string(++last_node_)));
    for (int other = 0; other < static_cast<int>(scenario_.graphs.size()); ++other)
      if (other != graph)
        lasting_readers_.insert(add_reader(other, local_name(other, topic), topic, Qos{}));
  }
}

void Crowd::start() {
  for (const auto& topic : scenario_.topics) {
    if (topic.lasting) {
      add_lasting(topic);
      continue;
    }
    for (const int graph : topic.graphs) {
      const auto count = scenario_.day ? 1 : rng_.between(1, 4);
      for (int i = 0; i < count; ++i) {
        schedule_.after(rng_.between(0ms, 2s), [this, &topic, graph] {
          if (!calm_) add_writer(topic, graph, "writer" + std::to_string(++last_node_));
        });
      }
    }
  }
  auto readers = rng_.between(1, 4 * static_cast<int>(scenario_.topics.size()) + 3);
  if (scenario_.day) readers = std::min<std::int64_t>(readers, kOfADayMax / 2);
  for (int i = 0; i < readers; ++i) {
    schedule_.after(rng_.between(0ms, 2s), [this] {
      if (!calm_) add_random_reader();
    });
  }
  schedule_.after(scenario_.churn, [this] { churn(); });
}

void Crowd::remove_writer(std::size_t at) {
  if (verbose_) tell("publisher " + std::to_string(writers_[at]) + " is gone", writers_[at], true);
  middleware_.destroy_writer(writers_[at]);
  writers_.erase(writers_.begin() + static_cast<std::ptrdiff_t>(at));
}

void Crowd::churn() {
  if (calm_) return;
  if (!paused_) change();
  schedule_.after(rng_.between(scenario_.churn / 4, scenario_.churn * 2), [this] { churn(); });
}

void Crowd::change() {
  const auto what = rng_.below(5);
  if (what == 0 && writers_.size() < endpoints_max_) {
    const TopicPlan& topic = rng_.pick(scenario_.topics);
    add_writer(topic, rng_.pick(topic.graphs), "writer" + std::to_string(++last_node_));
  } else if (what == 1 && !writers_.empty()) {
    const auto at = rng_.below(writers_.size());
    if (!lasting_writers_.contains(writers_[at])) remove_writer(at);
  } else if (what == 2 && !writers_.empty()) {
    // A node restarts: the same name, another publisher, at once or a little later.
    const auto at = rng_.below(writers_.size());
    if (lasting_writers_.contains(writers_[at])) return;
    const EndpointSpec old = middleware_.writer(writers_[at]).spec;
    const TopicPlan& topic = plan_of(writers_[at]);
    remove_writer(at);
    const Duration gap = rng_.chance(500) ? 0ms : rng_.between(1ms, 800ms);
    schedule_.after(gap, [this, &topic, old] {
      if (!calm_) add_writer(topic, old.graph, old.node_name);
    });
  } else if (what == 3 && readers_.size() < endpoints_max_) {
    add_random_reader();
  } else if (!readers_.empty()) {
    const auto at = rng_.below(readers_.size());
    if (lasting_readers_.contains(readers_[at])) return;
    if (verbose_) {
      tell("subscriber " + std::to_string(readers_[at]) + " is gone", readers_[at], false);
    }
    middleware_.destroy_reader(readers_[at]);
    readers_.erase(readers_.begin() + static_cast<std::ptrdiff_t>(at));
  }
}

void Crowd::tick(int writer) {
  if (calm_ || !middleware_.writer(writer).alive) return;
  if (!paused_) publish(writer);
  const Duration period = plan_of(writer).period;
  schedule_.after(rng_.between(period / 2, period * 3 / 2), [this, writer] { tick(writer); });
}

void Crowd::publish(int writer) {
  const Writer& state = middleware_.writer(writer);
  if (!state.alive) return;
  const TopicPlan& topic = plan_of(writer);
  const auto size = static_cast<std::size_t>(rng_.between(
      static_cast<std::int64_t>(topic.bytes_min), static_cast<std::int64_t>(topic.bytes_max)));
  ledger_.note_published(writer);
  const Label label{static_cast<std::uint32_t>(writer), state.count + 1};
  middleware_.publish(
      writer, Payload::adopt(make_message(state.spec.type, label, size, topic.compressible)));
}

void Crowd::calm() {
  calm_ = true;
}

Duration Crowd::pause_after(int writer, std::uint64_t known) {
  return rng_.between(15ms, 25ms) + scenario_.time_to_send(plan_of(writer).bytes_max, known);
}

Duration Crowd::publish_round(std::uint64_t known) {
  Duration at{};
  for (const int writer : writers_) {
    schedule_.after(at, [this, writer] { publish(writer); });
    at += pause_after(writer, known);
  }
  return at;
}

Duration Crowd::last_words(std::uint64_t known) {
  Duration at{};
  for (const int writer : writers_) {
    schedule_.after(at, [this, writer] { publish(writer); });
    schedule_.after(at + rng_.between(1ms, 30ms), [this, writer] {
      if (verbose_) tell("publisher " + std::to_string(writer) + " ends", writer, true);
      middleware_.destroy_writer(writer);
    });
    at += pause_after(writer, known);
  }
  writers_.clear();
  return at;
}

void Crowd::remove_readers() {
  for (const int id : readers_) middleware_.destroy_reader(id);
  readers_.clear();
}

}  // namespace connect_bridge::sim
