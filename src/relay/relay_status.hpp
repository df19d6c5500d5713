// The status of a relay, at one moment, in the words of a server's status (docs/status.md).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.hpp"

namespace connect_bridge {

// Why somebody who came was not let in.
enum class RelayRefusal : std::uint8_t {
  kNoClientHello,     // it does not begin with one, or with a wrong one
  kTooLate,           // no whole one, or no login, in time
  kGaveWay,           // it waited longest, and others came
  kHandshakes,        // a control connection: its address, or all, had begun too many
  kNoTls,             // a control connection: the handshake failed
  kWrongLogin,        // the token is not that of the name
  kNoSuchRobot,       // it is unknown, or not here
  kRobotFull,         // it has as many pairs as it may
  kVisitorsOfSource,  // too many of one address
  kVisitorsOfRobot,   // too many for one robot
  kRobotSilent,       // the robot has not fetched the visitor in time
  kWrongTicket,       // unknown, used, or too old
  kTwin,              // a control connection: another one with its token is here, and answers
};
inline constexpr std::size_t kRelayRefusals = 13;
// "no_such_robot": in JSON, and as a label of metrics.
[[nodiscard]] std::string_view name_of(RelayRefusal refusal);

// The use that one robot has of the relay. Bytes include those of TLS, and not those of IP.
struct RelayUse {
  std::size_t pairs = 0;          // now
  std::uint64_t visitors = 0;     // who were joined with it
  std::uint64_t to_robot = 0;     // bytes
  std::uint64_t to_visitors = 0;  // bytes
};

struct RelayStatus {
  struct Robot {
    std::string name;
    std::string peer;  // its address and port; empty: it is not here, a pair is left
    Duration here_for{};
    RelayUse use;
    bool twin = false;  // another machine has come with its token lately
  };
  std::string time, started, version;
  std::vector<Robot> robots;
  std::size_t waiting = 0;     // in no pair, and without a login
  std::uint64_t accepted = 0;  // connections
  RelayUse all;                // of all robots, since the start
  std::array<std::uint64_t, kRelayRefusals> refused{};
  std::string certificate_valid_until;  // of the relay's own; empty: it never ends
};

// `with_peers`: where the robots are.
[[nodiscard]] std::string to_json(const RelayStatus& status, bool in_lines, bool with_peers);
// `open`: OpenMetrics 1.0, else the text format 0.0.4.
[[nodiscard]] std::string to_metrics(const RelayStatus& status, bool open);

}  // namespace connect_bridge
