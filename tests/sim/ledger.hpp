// The truth about a world that all checkers share: who published what and when, which rules were in
// force, who may be connected to whom. Rules use names on the wire, at both ends.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "sim/coverage.hpp"
#include "sim/host.hpp"
#include "sim/middleware.hpp"
#include "sim/schedule.hpp"

namespace connect_bridge::sim {

inline constexpr char kClaimsTopicName[] = "/_connect_bridge/claims";
inline constexpr char kHostilePrefix[] = "/hostile/";
// A service whose server is in the graph, and which nobody can reach.
inline constexpr char kDeafService[] = "/hostile/deaf";

inline bool is_claims(const std::string& topic) {
  return topic == kClaimsTopicName;
}
inline bool is_hostile(const std::string& topic) {
  return topic.rfind(kHostilePrefix, 0) == 0;
}

// Its publishers are made by the sides themselves (rule key `clock`).
inline bool is_clock(const std::string& topic) {
  return topic.size() >= 6 && topic.compare(topic.size() - 6, 6, "/clock") == 0;
}
inline bool is_of_action(const std::string& topic) {
  return topic.find("/_action/") != std::string::npos;
}
// What drives a robot has a checker of its own (sim/driving.hpp).
inline constexpr char kDriveTopic[] = "/driving/cmd_vel";
inline bool is_ordinary(const std::string& topic) {
  return topic != kDriveTopic && !is_claims(topic) && !is_hostile(topic) && !is_clock(topic) &&
         !is_of_action(topic);
}

// A client and the server it dials.
struct Pair {
  Host* client = nullptr;
  Host* server = nullptr;
  int path = 0;
  Identity identity;  // who the server takes the client for
  bool may_log_in = true;
};

class Ledger {
 public:
  // More than any publisher keeps for late subscribers.
  static constexpr std::size_t kPublisherKeeps = 32;

  Ledger(const Schedule& schedule, const Middleware& middleware)
      : schedule_(schedule), middleware_(middleware) {}

  void add_pair(Pair pair) { pairs_.push_back(std::move(pair)); }
  [[nodiscard]] const std::vector<Pair>& pairs() const { return pairs_; }

  // A process that starts again has the same rules as before.
  void note_policy(const Host& host) {
    auto& all = policies_[host.index()];
    if (!all.empty() && all.back().number == host.policy_number()) return;
    all.push_back({schedule_.now(), host.policy_number(), host.policy()});
  }
  void note_published(int writer) { published_[writer].times.push_back(schedule_.now()); }

  [[nodiscard]] TimePoint published_at(int writer, std::uint64_t counter) const {
    const Published& published = published_.at(writer);
    return published.times.at(counter - 1 - published.forgotten);
  }
  [[nodiscard]] std::uint64_t published(int writer) const {
    const auto it = published_.find(writer);
    return it == published_.end() ? 0 : it->second.forgotten + it->second.times.size();
  }
  [[nodiscard]] bool has_forgotten(int writer, std::uint64_t counter) const {
    const auto it = published_.find(writer);
    return it == published_.end() || counter <= it->second.forgotten;
  }
  // When messages were published before, but for the last ones, which a publisher may still keep.
  void forget(TimePoint before) {
    std::erase_if(published_,
                  [this](const auto& p) { return !middleware_.writers().knows(p.first); });
    for (auto& [writer, published] : published_)
      while (published.times.size() > kPublisherKeeps && published.times.front() < before) {
        published.times.pop_front();
        ++published.forgotten;
      }
  }

  // Some clock is set while the world runs: then offsets are wrong for a while.
  void note_clock_step() { clock_steps_ = true; }
  // Also where one was set not long ago.
  [[nodiscard]] bool clock_steps() const {
    return clock_steps_ || was_clock_stepped_since(now() - kClockLearnt);
  }
  // It was set just now.
  void note_clock_stepped() { clock_stepped_at_ = schedule_.now(); }
  [[nodiscard]] bool was_clock_stepped_since(TimePoint since) const {
    return clock_stepped_at_ && *clock_stepped_at_ >= since;
  }

  // Nothing changes but the network.
  void note_steady() { steady_ = true; }
  [[nodiscard]] bool steady() const { return steady_; }

  // The peers a host can be linked with, and as whom each is seen by the other.
  struct Peer {
    const Host* host = nullptr;
    Identity seen_as;  // the peer, as the host sees it
    Identity sees_us;  // the host, as the peer sees it
  };
  [[nodiscard]] std::vector<Peer> peers_of(const Host& host) const {
    std::vector<Peer> result;
    for (const auto& pair : pairs_) {
      if (!pair.may_log_in) continue;
      if (pair.client == &host) result.push_back({pair.server, {}, pair.identity});
      if (pair.server == &host) result.push_back({pair.client, pair.identity, {}});
    }
    return result;
  }

  // How many policies a host has had.
  [[nodiscard]] std::size_t policies_of(const Host& host) const {
    const auto found = policies_.find(host.index());
    return found == policies_.end() ? 0 : found->second.size();
  }

  // Whether any policy that was in force at `host` from `since` on permits it.
  [[nodiscard]] bool was_permitted(const Host& host, TimePoint since, Direction direction,
                                   InterfaceKind kind, const std::string& name,
                                   const std::string& type, const Identity& who) const {
    const auto found = policies_.find(host.index());
    if (found == policies_.end()) return false;  // it has not started yet
    const auto& all = found->second;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const bool ended = i + 1 < all.size() && all[i + 1].from < since;
      if (ended) continue;
      const bool service = kind == InterfaceKind::kService;
      if (service && service_treatment_of(all[i].policy, direction, name, type, who)) return true;
      if (!service && is_permitted(all[i].policy, direction, name, type, who)) return true;
    }
    return false;
  }

  [[nodiscard]] const Middleware& middleware() const { return middleware_; }
  [[nodiscard]] TimePoint now() const { return schedule_.now(); }
  [[nodiscard]] Coverage& coverage() const { return coverage_; }

 private:
  struct InForce {
    TimePoint from;
    int number = 0;
    Policy policy;
  };
  struct Published {
    std::uint64_t forgotten = 0;
    std::deque<TimePoint> times;  // of those after them
  };
  // Until a side that has asked for the peer's clock again knows that it was set.
  static constexpr Duration kClockLearnt = std::chrono::seconds(30);

  const Schedule& schedule_;
  const Middleware& middleware_;
  mutable Coverage coverage_;
  bool clock_steps_ = false;
  bool steady_ = false;
  std::optional<TimePoint> clock_stepped_at_;
  std::vector<Pair> pairs_;
  std::unordered_map<int, std::vector<InForce>> policies_;  // by host
  std::unordered_map<int, Published> published_;            // by writer
};

// "reader 7 of /tf (side 1)", for sentences.
std::string describe(const Host& host);

}  // namespace connect_bridge::sim
