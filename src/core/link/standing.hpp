// How the login of a link stands while the link lives: it is renewed, changed, withdrawn, expires.
#pragma once

#include <string>

#include "core/link/dialer.hpp"
#include "core/link/link.hpp"
#include "core/link/options.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// Why the login method's answer refuses the login; empty: it does not.
[[nodiscard]] std::string refusal(const Authenticated& answer, const Now& now);

// Counts a link that was ended for what no peer may do (by this code) for its identity. An identity
// with too many of them must wait for its next login.
void note_offence(Link& link, CloseCode code, const Now& now);
// Server: when this identity may log in. `continued`: the link that the login would continue, or
// null. Each link without an identity is judged by itself.
[[nodiscard]] TimePoint may_log_in_at(const Identity& identity, const Link* continued,
                                      Accounts& accounts);

// Logs that a server closes a connection without a link, at a limited rate: strangers could cause
// any number of such lines.
void note_refusal(const Connection& refused, const Error& why, LogLimit& limit, Outputs& outputs,
                  const Now& now);

// Whether the newer link may belong to the client of the older one, after a restart.
[[nodiscard]] bool is_successor(const Link& newer, const Link& older);

// ---- a connection is about to carry the link
// Whether the peer was started again since the last one.
[[nodiscard]] bool is_replaced(const Link& link, const Peer& peer);
// What the log adds about the former connection. `resumes`: messages that were kept will follow.
[[nodiscard]] std::string past_of(const Link& link, const Peer& peer, bool resumes);

// ---- a server's
// The client logs in again: the login method is asked. Errors: kIllegal while it is asked already,
// kTooLarge when that happens too often.
Result<Nothing> ask_for_renewal(Link& link, const Renew& renew, Outputs& outputs, const Now& now);
// The login method's answer. True: the identity's groups have changed, so rights must be evaluated
// again.
bool take_renewal(Link& link, const Authenticated& answer, Outputs& outputs, const Now& now);
// The login method reports a change by itself. True: the identity has changed. If the identity is
// gone the link fails, or is forgotten if it is lost.
bool take_change(Link& link, const IdentitiesChanged& changed, Outputs& outputs, const Now& now);
// Ends what has expired, and notes when to look again.
void check_expiry(Link& link, const Now& now);

// ---- a connection has ended
// What that means for its link: the peer, or the network, has ended it with this code. `role`:
// ours.
[[nodiscard]] Loss loss_by(std::optional<std::uint16_t> close_code, Role role);
// The same: this side ends the link's connection.
[[nodiscard]] Loss loss_by(const Error& ours, const Link& link, const Now& now);
// What this side gives as reason when it stops: the peer reads it.
inline constexpr char kPeerStops[] = "the peer is stopping";
// Whether the peer itself has ended the connection in order. A proxy that stops sends the same code
// with another reason.
[[nodiscard]] bool is_orderly(const ConnectionClosed& closed);
// Why it was closed: by the peer's code, if it sent one. The peer's words are marked as such.
[[nodiscard]] Failure failure_of(const ConnectionClosed& closed);

// ---- a client's
// The kind of wait for the next dial that the end of a dial or connection causes.
[[nodiscard]] DialFailure wait_after(Cause cause);
// What the user should do about the end of a connection; for the log.
[[nodiscard]] std::string advice(Cause cause);

}  // namespace connect_bridge
