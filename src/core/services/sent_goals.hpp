// The goals of peers that a rule ends when their sender is gone (`cancel_after`).
#pragma once

#include <array>
#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/ids.hpp"
#include "core/base/time.hpp"
#include "core/ports/audit.hpp"

namespace connect_bridge {

using GoalId = std::array<std::uint8_t, 16>;
// The id in a request for a goal or for its result; it comes first in both.
[[nodiscard]] std::optional<GoalId> goal_in(ByteView request);
// A request to cancel this goal: action_msgs/srv/CancelGoal.
[[nodiscard]] Payload cancel_request(const GoalId& goal);
// Whether its server cancels the goal: action_msgs/srv/CancelGoal_Response.
[[nodiscard]] bool accepts_cancel(ByteView answer);

struct GoalSender {
  LinkId link;
  std::string identity{};
  Token128 process{};   // the peer's side
  std::string owner{};  // of the link, for the log
};

struct SentGoal {
  std::string action;  // local name
  GoalId id{};
  GoalSender sender;
  InvocationId sent;  // the request that sent it
  Duration cancel_after{};
  std::optional<Audit> line{};      // for the audit log, as of the goal
  InvocationId result{};            // a request for its result; none: nobody waits for it
  std::optional<TimePoint> ends{};  // the link is lost: the goal is cancelled then
};

// Knows the goals that were sent and, as far as results show, have not ended. One goal more than
// kGoalsMax of a link makes it forget that link's oldest. Pure. Single-threaded.
class SentGoals {
 public:
  static constexpr std::size_t kGoalsMax = 256;
  // Goals of all links; beyond that the oldest of the identity with the most is forgotten.
  static constexpr std::size_t kAllMax = 4096;

  void add(SentGoal goal);
  // The server has this request for the result of a goal.
  void on_asked(const std::string& action, ByteView request, InvocationId invocation);
  // The server has refused the goal of this request, or has told its result.
  void on_ended(InvocationId invocation);
  // The server of the action is gone, and its goals with it.
  void on_server_gone(const std::string& action);
  void on_link_lost(LinkId link, TimePoint now);
  // The calls of the link have ended: the server gets no goal of it any longer.
  void on_link_dead(LinkId link, TimePoint now);
  // The process that has sent goals may come back by another link. Another process does not know
  // them, also if it goes on with the link.
  void on_link_open(const GoalSender& peer);

  // The goals to cancel now.
  [[nodiscard]] std::vector<SentGoal> take_due(TimePoint now);
  [[nodiscard]] std::optional<TimePoint> deadline() const { return first_; }

 private:
  // `sender`: the identity that sends one more. Goals of it go first, if no other has more.
  void forget_one(const std::string& sender);
  void update();

  std::list<SentGoal> goals_;         // in the order of their requests
  std::map<LinkId, TimePoint> lost_;  // links whose calls still wait for their turn
  std::optional<TimePoint> first_{};  // the first of their ends
};

}  // namespace connect_bridge
