// Links with open connections and what topics need, without a side.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/graph/side_view.hpp"
#include "unit/link/quiet_user.hpp"
#include "unit/side/words.hpp"

namespace connect_bridge::topics_test {

using namespace side_test;

Now ms(std::int64_t at);

// Link n, open: what it would send is read as words. The peer accepts everything.
struct OneLink final : private link_test::QuietUser {
  explicit OneLink(std::uint32_t n = 1,
                   std::shared_ptr<Account> account = std::make_shared<Account>(),
                   Duration resume_for = {});
  ~OneLink();
  // One packet per line.
  std::string said(std::int64_t at = 0);
  // Its connection and channels are gone; owners of channels are told by the test.
  void lose(std::int64_t at = 0);
  // Another connection carries it.
  void connect(std::int64_t at = 0);
  void connect(const ConnectionOptions& options, std::int64_t at = 0);
  // Its path has shown this round trip by 50 ms: a new connection may send 32 KiB in each.
  void show_round_trip(std::int64_t round_trip_ms = 50);

  Link link;
};

// A side's parts, and their actions. From 1000 bytes on a worker compresses and decompresses.
struct Actions {
  // The actions since the last call, one per line. Logs are kept apart.
  std::string did();
  // The worker is done with the last job.
  void finish(std::optional<Payload> result, std::int64_t at = 0);
  // Whether this is to be done since it was asked last for anything.
  bool takes(FollowUp what);

  Outputs outputs;
  GraphOptions names;
  Policy policy;
  GraphView graph;
  Claims claims{Token128{}};
  LocalActions actions;
  Jobs jobs{{1000}, outputs};
  SideView side{names, policy, graph, claims, actions, jobs, outputs};
  std::string logged;
  JobId last_job;
};

// Compressed, on channel 1, as it lies in this packet; more than a worker takes at once.
InMessage call_in(const std::shared_ptr<Bytes>& packet);

GraphView picture(const std::vector<Topic>& topics);

}  // namespace connect_bridge::topics_test
