#include "core/base/close_code.hpp"

namespace connect_bridge {

std::string_view name_of(CloseCode code) {
  switch (code) {
    case CloseCode::kNormal: return "normal";
    case CloseCode::kGoingAway: return "going_away";
    case CloseCode::kVersion: return "version";
    case CloseCode::kMalformed: return "malformed";
    case CloseCode::kLoginRefused: return "login_refused";
    case CloseCode::kLoginTimeout: return "login_timeout";
    case CloseCode::kReplaced: return "replaced";
    case CloseCode::kTooLarge: return "too_large";
    case CloseCode::kSlowPeer: return "slow_peer";
    case CloseCode::kSilent: return "silent";
    case CloseCode::kIllegal: return "illegal";
    case CloseCode::kUnknownChannel: return "unknown_channel";
    case CloseCode::kSameSide: return "same_side";
    case CloseCode::kTooManyConnections: return "too_many_connections";
    case CloseCode::kExpired: return "expired";
    case CloseCode::kInternal: return "internal";
    case CloseCode::kRevoked: return "revoked";
    case CloseCode::kLoginNotJudged: return "login_not_judged";
  }
  return "unknown";
}

}  // namespace connect_bridge
