#include "core/link/loss.hpp"

#include "core/link/link.hpp"

namespace connect_bridge {

// A client that says goodbye needs no place any more. A server that does so is mostly restarted:
// its mirrors wait for it as after any loss.
Loss loss_by(std::optional<std::uint16_t> close_code, Role role) {
  if (!close_code) return Loss::kBreak;
  switch (static_cast<CloseCode>(*close_code)) {
    case CloseCode::kNormal:
    case CloseCode::kGoingAway: return role == Role::kServer ? Loss::kEnd : Loss::kRestart;
    case CloseCode::kRevoked: return Loss::kRestart;
    default: return Loss::kBreak;
  }
}

// Silence on a changed network is known earlier than that the peer is gone.
Loss loss_by(const Error& ours, const Link& link, const Now& now) {
  if (ours.code == CloseCode::kRevoked) return Loss::kEnd;
  const bool silent = ours.code == CloseCode::kSilent && now.steady >= link.connection()->dead_at();
  return silent ? Loss::kSilence : Loss::kBreak;
}

}  // namespace connect_bridge
