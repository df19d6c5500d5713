#include "core/services/sent_goals.hpp"

#include <algorithm>
#include <iterator>
#include <string_view>
#include <utility>

#include "core/base/cdr.hpp"
#include "core/base/timers.hpp"

namespace connect_bridge {

std::optional<GoalId> goal_in(ByteView request) {
  GoalId id;
  if (!is_serialized(request) || request.size() < kCdrHeaderBytes + id.size()) return std::nullopt;
  std::copy_n(request.begin() + kCdrHeaderBytes, id.size(), id.begin());
  return id;
}

// A time of zero with an id cancels that goal alone.
Payload cancel_request(const GoalId& goal) {
  CdrWriter writer;
  for (const std::uint8_t byte : goal) writer.u8(byte);
  return writer.u32(0).u32(0).take();
}

bool accepts_cancel(ByteView answer) {
  CdrReader reader(answer);
  constexpr std::uint8_t kNone = 0;  // no error
  const bool is_error = reader.u8() != kNone;
  return !is_error && reader.u32().value_or(0) > 0;  // the goals that it cancels
}

void SentGoals::add(SentGoal goal) {
  // A server refuses an id that it has: the goal stays that of who sent it first.
  const auto is_same = [&](const SentGoal& known) {
    return known.action == goal.action && known.id == goal.id;
  };
  if (std::any_of(goals_.begin(), goals_.end(), is_same)) return;
  const auto is_of_link = [&](const SentGoal& known) {
    return known.sender.link == goal.sender.link;
  };
  if (std::count_if(goals_.begin(), goals_.end(), is_of_link) >=
      static_cast<std::ptrdiff_t>(kGoalsMax))
    goals_.erase(std::find_if(goals_.begin(), goals_.end(), is_of_link));
  if (goals_.size() >= kAllMax) forget_one(goal.sender.identity);
  if (const auto lost = lost_.find(goal.sender.link); lost != lost_.end())
    goal.ends = lost->second + goal.cancel_after;
  goals_.push_back(std::move(goal));
  update();
}

// So no identity pushes out goals of others, which would then not be cancelled.
void SentGoals::forget_one(const std::string& sender) {
  std::map<std::string_view, std::size_t> counts{{sender, 0}};
  for (const SentGoal& goal : goals_) ++counts[goal.sender.identity];
  std::string_view most = sender;
  for (const auto& [identity, count] : counts)
    if (count > counts.at(most)) most = identity;
  goals_.erase(std::find_if(goals_.begin(), goals_.end(),
                            [&](const SentGoal& goal) { return goal.sender.identity == most; }));
}

void SentGoals::on_asked(const std::string& action, ByteView request, InvocationId invocation) {
  if (goals_.empty()) return;
  const auto id = goal_in(request);
  for (SentGoal& goal : goals_)
    if (id && goal.id == *id && goal.action == action) goal.result = invocation;
}

void SentGoals::on_ended(InvocationId invocation) {
  const auto ended = std::erase_if(goals_, [&](const SentGoal& goal) {
    return goal.sent == invocation || goal.result == invocation;
  });
  if (ended > 0) update();
}

void SentGoals::on_server_gone(const std::string& action) {
  if (std::erase_if(goals_, [&](const SentGoal& goal) { return goal.action == action; }) > 0)
    update();
}

// A loss and the end of the link after it are one.
void SentGoals::on_link_lost(LinkId link, TimePoint now) {
  lost_.try_emplace(link, now);
  for (SentGoal& goal : goals_)
    if (goal.sender.link == link && !goal.ends) goal.ends = now + goal.cancel_after;
  update();
}

void SentGoals::on_link_dead(LinkId link, TimePoint now) {
  on_link_lost(link, now);
  lost_.erase(link);
}

void SentGoals::on_link_open(const GoalSender& peer) {
  lost_.erase(peer.link);
  for (SentGoal& goal : goals_) {
    if (goal.sender.process != peer.process || goal.sender.identity != peer.identity) continue;
    goal.sender.link = peer.link;
    goal.ends.reset();
  }
  update();
}

std::vector<SentGoal> SentGoals::take_due(TimePoint now) {
  std::vector<SentGoal> due;
  if (!first_ || *first_ > now) return due;
  for (auto it = goals_.begin(); it != goals_.end();) {
    const auto at = it++;
    if (!at->ends || *at->ends > now) continue;
    due.push_back(std::move(*at));
    goals_.erase(at);
  }
  update();
  return due;
}

void SentGoals::update() {
  first_.reset();
  for (const SentGoal& goal : goals_) first_ = earliest(first_, goal.ends);
}

}  // namespace connect_bridge
