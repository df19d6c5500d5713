// The login of a link while the link lives: it is renewed, changed or withdrawn, or expires.
#pragma once

#include <string>

#include "core/link/dialer.hpp"
#include "core/link/link.hpp"
#include "core/link/options.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// The reason why the login method's answer refuses the login; empty: it does not.
[[nodiscard]] std::string refusal(const Authenticated& answer, const Now& now);

// Counts, for the identity, a link that was closed for an offence (by this code). An identity with
// too many offences must wait for its next login.
void note_offence(Link& link, CloseCode code, const Now& now);
// Server: the time at which this identity may log in. `continued`: the link that the login would
// continue, or null. Each link without an identity is judged by itself.
[[nodiscard]] TimePoint may_log_in_at(const Identity& identity, const Link* continued,
                                      Accounts& accounts);

// Logs that a server closes a connection without a link, at a limited rate: unauthenticated peers
// could cause any number of such lines.
void note_refusal(const Connection& refused, const Error& why, LogLimit& limit, Outputs& outputs,
                  const Now& now);

// May the newer link belong to the client of the older one, after a restart?
[[nodiscard]] bool is_successor(const Link& newer, const Link& older);

// ---- a connection is about to carry the link
// Was the peer started again since the last connection?
[[nodiscard]] bool is_replaced(const Link& link, const Peer& peer);
// The log's addition about the former connection. `resumes`: kept messages will follow.
[[nodiscard]] std::string past_of(const Link& link, const Peer& peer, bool resumes);

// ---- server
// The client logs in again: the login method is asked. Errors: kIllegal while a renewal is
// unanswered, kTooLarge when the client renews too often.
Result<Nothing> ask_for_renewal(Link& link, const Renew& renew, Outputs& outputs, const Now& now);
// Takes the login method's answer. True: the identity's groups have changed, so rights must be
// evaluated again.
bool take_renewal(Link& link, const Authenticated& answer, Outputs& outputs, const Now& now);
// The change that concerns the link; null: there is none.
[[nodiscard]] const IdentitiesChanged::Change* change_of(const Link& link,
                                                         const IdentitiesChanged& changed);
// The login method reports a change by itself. True: the identity has changed. If the identity is
// gone, the link fails; a lost link is forgotten.
bool take_change(Link& link, const IdentitiesChanged& changed, Outputs& outputs, const Now& now);
// Closes the link if its login or certificate has expired, and notes the time of the next check.
void check_expiry(Link& link, const Now& now);

// ---- a connection has ended
// The consequence for its link, if the peer or the network has closed it with this code. `role`:
// ours.
[[nodiscard]] Loss loss_by(std::optional<std::uint16_t> close_code, Role role);
// The consequence if this side closes the link's connection.
[[nodiscard]] Loss loss_by(const Error& ours, const Link& link, const Now& now);
// The reason that this side gives when it stops; the peer reads it.
inline constexpr char kPeerStops[] = "the peer is stopping";
// Has the peer itself closed the connection in order? A proxy that stops sends the same code with
// another reason.
[[nodiscard]] bool is_orderly(const ConnectionClosed& closed);
// Why it was closed: by the peer's code, if it sent one. The peer's words are marked as such.
[[nodiscard]] Failure failure_of(const ConnectionClosed& closed);

// ---- a client's
// The kind of wait for the next dial that the end of a dial or connection causes.
[[nodiscard]] DialFailure wait_after(Cause cause);
// What the user should do about the end of a connection; for the log.
[[nodiscard]] std::string advice(Cause cause);

}  // namespace connect_bridge
