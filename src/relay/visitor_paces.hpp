// How many visitors a relay leads to a robot.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/base/address_paces.hpp"
#include "net/relay/relay_wire.hpp"

namespace connect_bridge {

// The limits of docs/protocol.md, "Relay". A visitor counts in each limit that holds for it, or in
// none. Thread: one.
class VisitorPaces {
 public:
  enum class Kind : std::uint8_t {
    kAny,     // the robot has told no word
    kClient,  // the visitor has shown the robot's word
    kOther,   // the visitor has not
  };

  // `network`: of the visitor.
  [[nodiscard]] bool take(const std::string& robot, const std::string& network, Kind kind,
                          TimePoint now) {
    std::vector<std::pair<AddressPaces*, std::string>> limits{{&all_, robot}};
    if (kind != Kind::kAny) {
      Metered& metered = kind == Kind::kClient ? clients_ : others_;
      limits.emplace_back(&metered.of_robot, robot);  // mutant: others_of_robot
      limits.emplace_back(&metered.of_network, robot + ' ' + network);
    }
    for (auto limit = limits.begin(); limit != limits.end(); ++limit) {
      if (limit->first->take(limit->second, 1, now)) continue;
      while (limit != limits.begin()) {
        --limit;
        limit->first->give_back(limit->second);
      }
      return false;
    }
    return true;
  }

 private:
  struct Metered {
    AddressPaces of_robot, of_network;
  };

  AddressPaces all_{kVisitorsAtOnce, kVisitorPeriod};
  Metered clients_{{kClientsAtOnce, kClientsPeriod}, {kClientsOfNetworkAtOnce, kMeteredPeriod}};
  Metered others_{{kOthersAtOnce, kMeteredPeriod},
                  {kOthersOfNetworkAtOnce, kOthersOfNetworkPeriod}};
};

}  // namespace connect_bridge
