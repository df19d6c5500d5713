// A graph with an action.
#pragma once

#include <optional>
#include <string>

#include "unit/side/script.hpp"

namespace connect_bridge::side_test {

template <class State>
State typed(State state, const std::string& type) {
  state.type = type;
  return state;
}

// A rule for all topics, services and actions.
inline Rule acting() {
  Rule result = callable();
  result.opens[Direction::kExport][OpenedBy::kActions] =
      result.opens[Direction::kImport][OpenedBy::kActions] = {Pattern::parse("/**").value()};
  return result;
}

// There is a server of the action /fib; `lack`: why the type of its goals cannot be taken.
inline void serve_action(Script& s, const std::optional<TypeLack>& lack = {}) {
  auto goal = typed(service("/fib/_action/send_goal"), "p/action/Fib_SendGoal");
  goal.lack = lack;
  s.graph({typed(topic("/fib/_action/feedback").pub(1), "p/action/Fib_FeedbackMessage"),
           typed(topic("/fib/_action/status").pub(2), "action_msgs/msg/GoalStatusArray")},
          {goal, typed(service("/fib/_action/cancel_goal"), "action_msgs/srv/CancelGoal"),
           typed(service("/fib/_action/get_result"), "p/action/Fib_GetResult")});
}

}  // namespace connect_bridge::side_test
