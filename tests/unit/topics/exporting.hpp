// A local topic without a side.
#pragma once

#include "core/topics/local_topic.hpp"
#include "unit/topics/one_link.hpp"

namespace connect_bridge::topics_test {

// From 1000 bytes on a worker compresses. Peers are declared before it: at its end it takes back
// what it has offered them.
struct Exporting : Actions {
  explicit Exporting(std::vector<Rule> rules = {everything()}, const std::string& type = kType,
                     const std::string& name = "/a")
      : subject{context, {name, type}} {
    policy = Policy(std::move(rules));
  }

  void see(const Topic& state, std::int64_t at = 0) {
    graph = picture({state});
    subject.on_graph(ms(at));
  }
  // Whether there was anything to offer.
  bool offer(OneLink& peer) { return subject.offer_to(peer.link, ms(0)).has_value(); }
  static void demand(OneLink& peer, bool on = true, std::int64_t at = 0) {
    peer.link.outgoing({1})->on_demand({{1}, static_cast<std::uint16_t>(on ? 1 : 0)}, ms(at));
  }
  void take(std::uint8_t publisher, const std::string& text, std::int64_t at = 0) {
    subject.on_taken({{}, gid(publisher), flow_test::at_ms(at + 1), sample(text), {}}, ms(at));
  }
  // Up to this moment, with every deadline at its time.
  void pass_to(std::int64_t at) {
    for (auto next = context.timers.deadline(); next && *next <= ms(at).steady;
         next = context.timers.deadline()) {
      Now now = ms(at);
      now.steady = *next;
      while (context.timers.take_due(*next)) on_time(now);
    }
  }
  void on_time(const Now& now) {
    std::size_t held = kHeldPerStep;
    subject.on_time(held, now);
  }

  TopicOptions options;
  ExportContext context{side, options};
  LocalTopic subject;
};

}  // namespace connect_bridge::topics_test
