// A ticket as a robot shows it.
#pragma once

#include <string>

#include "net/relay/relay_door.hpp"

namespace connect_bridge::test {

inline std::string ticket_hello(const std::string& robot, const std::string& ticket) {
  return TicketHellos().make(robot, ticket);
}

}  // namespace connect_bridge::test
