// The numbered reasons for closing a connection (docs/protocol.md, "Close codes").
#pragma once

#include <cstdint>
#include <string_view>

namespace connect_bridge {

// Sent as the WebSocket close code (RFC 6455 section 7.4: 4000-4999 are for applications).
enum class CloseCode : std::uint16_t {
  kNormal = 1000,
  kGoingAway = 1001,           // this side stops
  kVersion = 4001,             // no shared protocol version
  kMalformed = 4002,           // bytes that are no record, frame or message
  kLoginRefused = 4003,        // wrong or unknown credential
  kLoginTimeout = 4004,        // no complete login within its deadline
  kReplaced = 4005,            // a newer connection of the same session took over
  kTooLarge = 4006,            // a size or count beyond a limit of this side
  kSlowPeer = 4007,            // control messages back up: the peer does not read
  kSilent = 4008,              // nothing heard for dead_after
  kIllegal = 4009,             // a message that is not allowed in this state
  kUnknownChannel = 4010,      // data for a channel that was never offered or is withdrawn
  kSameSide = 4011,            // the peer is this process
  kTooManyConnections = 4012,  // a limit of connections or links reached
  kExpired = 4013,             // the identity's validity ended
  kInternal = 4014,            // a bug of this side
  kRevoked = 4015,             // the credential was withdrawn
  kLoginNotJudged = 4016,      // the login method could not judge just now
};

// The machine-readable name, as in docs/protocol.md ("login_refused").
std::string_view name_of(CloseCode code);

}  // namespace connect_bridge
