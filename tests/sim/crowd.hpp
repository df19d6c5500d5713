// The ordinary nodes of the simulated graphs: publishers and subscribers that come, go, and are
// replaced under the same name.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "sim/ledger.hpp"
#include "sim/middleware.hpp"
#include "sim/rng.hpp"
#include "sim/scenario.hpp"

namespace connect_bridge::sim {

class Crowd {
 public:
  Crowd(Schedule& schedule, Middleware& middleware, Ledger& ledger, const Scenario& scenario,
        Rng rng, bool verbose);

  void start();
  // Nothing of that happens for a while.
  void pause(bool on) { paused_ = on; }
  // No node comes, goes or publishes any more, except by the functions below.
  void calm();

  // Every publisher publishes one message, one after the other. Returns how long that takes;
  // `known`: as for Scenario::time_to_send().
  Duration publish_round(std::uint64_t known);
  // New reliable publishers, one of each volatile topic, publish one message each after they had
  // time to find their subscribers.
  void add_speakers();
  // One more subscriber with this QoS on a topic (as named in that graph).
  int add_reader(int graph, const std::string& topic, const TopicPlan& plan, const Qos& qos);
  void remove_readers();
  // Every publisher publishes once more and ends soon after. Returns how long that takes.
  Duration last_words(std::uint64_t known);

  [[nodiscard]] const std::vector<int>& speakers() const { return speakers_; }
  // Publishers and subscribers that exist now.
  [[nodiscard]] const std::vector<int>& writers() const { return writers_; }
  [[nodiscard]] const std::vector<int>& readers() const { return readers_; }
  [[nodiscard]] const TopicPlan& plan_of(int writer) const;
  // A topic's name in a graph.
  [[nodiscard]] std::string local_name(int graph, const TopicPlan& topic) const;

 private:
  int add_writer(const TopicPlan& topic, int graph, const std::string& node);
  int create_writer(const TopicPlan& topic, int graph, const std::string& node, const Qos& qos);
  void remove_writer(std::size_t at);
  void add_random_reader();
  void add_lasting(const TopicPlan& topic);
  void change();
  void churn();
  Duration pause_after(int writer, std::uint64_t known);
  void tick(int writer);
  void publish(int writer);
  void tell(const std::string& what, int id, bool writer) const;
  Qos writer_qos(const TopicPlan& topic);
  Qos reader_qos(const TopicPlan& topic);
  EndpointSpec spec(const TopicPlan& topic, int graph, const std::string& node, const Qos& qos);

  Schedule& schedule_;
  Middleware& middleware_;
  Ledger& ledger_;
  const Scenario& scenario_;
  Rng rng_;
  bool verbose_;
  bool calm_ = false, paused_ = false;
  std::size_t endpoints_max_;
  std::set<int> lasting_writers_, lasting_readers_;
  std::vector<int> writers_, readers_, speakers_;
  std::map<int, const TopicPlan*> plan_of_writer_;
  int last_node_ = 0;
};

}  // namespace connect_bridge::sim
