// How the login of a link stands while the link lives: it is renewed, changed, withdrawn, expires.
#pragma once

#include <string>

#include "core/link/dialer.hpp"
#include "core/link/link.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// Why the login method's answer refuses the login; empty: it does not.
[[nodiscard]] std::string refusal(const Authenticated& answer, const Now& now);

// Whether a peer that keeps to the protocol does not come to this end. Then it counts for its
// identity: one that offends again and again waits for its next login.
void note_offence(Link& link, CloseCode code, const Now& now);
// Server: when this identity may log in; `continued`: the link that goes on with that, or null.
// Links without an identity are judged singly.
[[nodiscard]] TimePoint may_log_in_at(const Identity& identity, const Link* continued,
                                      Accounts& accounts);

// A server closes a connection without a link: for the logs. Strangers can make as many of these
// lines as they like.
void note_refusal(const Connection& refused, const Error& why, LogLimit& limit, Outputs& outputs,
                  const Now& now);

// Whether the newer link can be of the same client after a restart.
[[nodiscard]] bool is_successor(const Link& newer, const Link& older);

// ---- a connection is about to carry the link
// Whether the peer was started again since the last one.
[[nodiscard]] bool is_replaced(const Link& link, const Peer& peer);
// What the log adds about the time before; `resumes`: there is something to go on with.
[[nodiscard]] std::string past_of(const Link& link, const Peer& peer, bool resumes);

// ---- a server's
// The client logs in again: the login method is asked. Errors: kIllegal while it is asked already,
// kTooLarge when that happens too often.
Result<Nothing> ask_for_renewal(Link& link, const Renew& renew, Outputs& outputs, const Now& now);
// Its answer. Whether the link may do other things now: the identity's groups have changed.
bool take_renewal(Link& link, const Authenticated& answer, Outputs& outputs, const Now& now);
// The login method reports a change by itself. Whether the identity has changed; without one the
// link fails, or is forgotten if it is lost.
bool take_change(Link& link, const IdentitiesChanged& changed, Outputs& outputs, const Now& now);
// Ends what has expired, and notes when to look again.
void check_expiry(Link& link, const Now& now);

// ---- a connection has ended
// What this side gives as reason when it stops: the peer reads it.
inline constexpr char kPeerStops[] = "the peer is stopping";
// The peer has ended it as it should. A proxy that stops has the same code, and other words.
[[nodiscard]] bool is_orderly(const ConnectionClosed& closed);
// Why, as text for the log. What the peer says is told as its own words.
[[nodiscard]] std::string reason_of(const ConnectionClosed& closed);

// ---- a client's
// The server wants another credential than the one that was shown.
[[nodiscard]] bool wants_other_credential(std::optional<std::uint16_t> close_code);
// How the end of a connection counts for the next dial.
[[nodiscard]] DialFailure failure_by(std::optional<std::uint16_t> close_code);
// What the user should do about the end of a connection; for the log.
[[nodiscard]] std::string advice(std::optional<std::uint16_t> close_code);

}  // namespace connect_bridge
