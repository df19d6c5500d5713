// The protocol between a robot and its relay (docs/protocol.md, "Relay").
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include "core/base/time.hpp"
#include "core/wire/login.hpp"

namespace connect_bridge {

// The first protocol that a ClientHello offers names the kind of connection; a visitor offers
// anything else.
inline constexpr char kRelayProtocol[] = "ros2-connect-relay.v1";
inline constexpr char kTicketProtocol[] = "ros2-connect-ticket.v1";
inline constexpr char kClientProtocol[] = "ros2-connect-client.v1";  // its words follow
inline constexpr std::size_t kClientWordsMax = 4;

inline constexpr std::size_t kRelayLineMax = 256;  // bytes with the line end
inline constexpr std::size_t kRobotLineMax = 80;
inline constexpr std::size_t kRelayLoginMax = kCredentialBytesMax + 8 + 65;

inline constexpr std::chrono::seconds kRelayPing{25};
inline constexpr std::chrono::seconds kRelayPong{5};
inline constexpr std::chrono::seconds kRelaySilence{60};
// Two robots with one token: so long the one that is here has to answer a ping, and so long the
// other one waits.
inline constexpr std::chrono::milliseconds kTwinAnswer{2000};
// The same after an answer to a copy's login: a slow path must not give the name to the copy.
inline constexpr std::chrono::milliseconds kKnownTwinAnswer{8000};
inline constexpr std::chrono::seconds kTwinWait{60};
inline constexpr std::chrono::seconds kTicketTime{5};
inline constexpr std::chrono::seconds kHelloTime{5};  // and as long for the login after it

// Lines of a control connection, beyond: it is closed. A robot asks less often than it may, a relay
// announces no more than these visitors.
inline constexpr int kRobotLinesAtOnce = 30;
inline constexpr Duration kRobotLinePeriod = std::chrono::milliseconds(500);
inline constexpr int kRelayLinesAtOnce = 200;
inline constexpr Duration kRelayLinePeriod = std::chrono::milliseconds(15);

// Visitors of one robot: the relay refuses more, and the robot dials for no more.
inline constexpr int kVisitorsAtOnce = 100;
inline constexpr Duration kVisitorPeriod = std::chrono::milliseconds(20);
// Visitors of a robot that has told its word. Each costs the robot some 2 kB: those who show the
// word at most 173 MB a day, all others 9 MB. Of each network fewer, so that none keeps others out.
inline constexpr int kClientsAtOnce = 300;
inline constexpr Duration kClientsPeriod = std::chrono::seconds(1);
inline constexpr int kClientsOfNetworkAtOnce = 60;
inline constexpr int kOthersAtOnce = 10;
inline constexpr Duration kMeteredPeriod = std::chrono::seconds(20);
inline constexpr int kOthersOfNetworkAtOnce = 4;
inline constexpr Duration kOthersOfNetworkPeriod = std::chrono::minutes(1);

// A list of protocols as TLS has it (RFC 7301): each with its length before it.
[[nodiscard]] inline std::string protocol_list(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += static_cast<char>(name.size()) + name;
  return list;
}

}  // namespace connect_bridge
