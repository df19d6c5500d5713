// Links with open connections and what topics stand on, without a side.
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/jobs/jobs.hpp"
#include "core/link/link.hpp"
#include "unit/link/script.hpp"
#include "unit/side/words.hpp"

namespace connect_bridge::topics_test {

using namespace side_test;

inline Now ms(std::int64_t at) {
  return flow_test::now_ms(at);
}

// Link n, open: what it would send is read as words. The peer accepts everything.
struct OneLink final : private LinkUser {
  explicit OneLink(std::uint32_t n = 1) : link({n}, *this) {
    link.node = "/peer";
    link.address = "10.0.0." + std::to_string(n);
    link.accepts = Accepts{{{{"/**"}, {}, {"/**"}, {"/**"}, {"/**"}}}, {}};
    link.connection = std::make_unique<Connection>(link_test::options(false), ConnectionId{n},
                                                   link.address, ms(0));
    while (link.connection->next_packet(ms(0))) {
    }
    const auto welcome = encode(link_test::a_welcome(static_cast<std::uint8_t>(100 + n)));
    link.connection->on_packet(false, Payload::copy_of(welcome), ms(0));
    link.connection->carry(link);
  }
  // One packet per line.
  std::string said(std::int64_t at = 0) {
    std::string lines;
    while (const auto packet = link.connection->next_packet(ms(at)))
      if (const std::string line = line_of(*packet); !line.empty()) lines += line + "\n";
    return lines;
  }

  Link link;

 private:
  Result<Nothing> on_offer(Link&, const Offer&, const Now&) override { return Nothing{}; }
  Result<Nothing> on_accepts(Link&, Accepts, const Now&) override { return Nothing{}; }
  void on_peer_time(const TimeReply&, Stamp) override {}
};

// The actions since the last call, one per line. Logs are kept apart.
struct Actions {
  std::string did() {
    std::string lines;
    while (const auto action = outputs.next()) {
      if (const auto* log = std::get_if<Log>(&*action)) logged += log->text + "\n";
      if (const auto* job = std::get_if<CompressJob>(&*action)) last_job = job->job;
      if (const auto* job = std::get_if<DecompressJob>(&*action)) last_job = job->job;
      if (const std::string word = word_of(*action); !word.empty()) lines += word + "\n";
    }
    return lines;
  }
  // The worker is done with the last job.
  void finish(Jobs& jobs, std::optional<Payload> result, std::int64_t at = 0) {
    JobDone done{last_job, std::move(result)};
    jobs.on_done(done, ms(at));
  }

  Outputs outputs;
  std::string logged;
  JobId last_job;
};

inline GraphView picture(const std::vector<Topic>& topics) {
  GraphChanged graph;
  for (const auto& t : topics) graph.topics.push_back(t);
  return GraphView(std::move(graph));
}

}  // namespace connect_bridge::topics_test
