#include "core/link/standing.hpp"

#include <algorithm>
#include <utility>

#include "core/link/link_audit.hpp"
#include "core/wire/text.hpp"

namespace connect_bridge {
namespace {

bool is(std::optional<std::uint16_t> number, CloseCode code) {
  return number == static_cast<std::uint16_t>(code);
}

// Logs a line about a renewal, at a limited rate: each link limits its renewals, but a peer can
// make new links.
void log_renewal(const Link& link, LogLevel level, std::string text, Outputs& outputs,
                 const Now& now) {
  if (const auto count = link.account->lines.count(now))
    outputs.log(level, std::move(text) + left_out(*count));
}

}  // namespace

std::string refusal(const Authenticated& answer, const Now& now) {
  if (!answer.identity) return answer.reason.empty() ? "no reason given" : answer.reason;
  const Stamp expires = answer.identity->expires;
  return expires != 0 && now.system >= expires ? "it has expired" : "";
}

void note_offence(Link& link, CloseCode code, const Now& now) {
  switch (code) {
    case CloseCode::kMalformed:
    case CloseCode::kTooLarge:
    case CloseCode::kIllegal:
    case CloseCode::kUnknownChannel: break;
    default: return;
  }
  link.login.note_offence();
  link.account->note_offence(now);
}

TimePoint may_log_in_at(const Identity& identity, const Link* continued, Accounts& accounts) {
  const bool innocent = continued && !continued->login.has_offended();
  return innocent || identity.name.empty() ? TimePoint{}
                                           : accounts.of(identity.name)->offences.free_at();
}

void note_refusal(const Connection& refused, const Error& why, LogLimit& limit, Outputs& outputs,
                  const Now& now) {
  const Peer& peer = refused.peer();
  if (const auto count = limit.count(now))
    outputs.log(
        LogLevel::kWarn,
        "closing " + peer.address + ": " + why.message + " (" + std::string(name_of(why.code)) +
            ")" +
            (*count > 1 ? "; " + std::to_string(*count) + " refused since the last line" : ""));
  if (!outputs.audits()) return;
  Audit line;
  line.event = AuditEvent::kRefused;
  line.address = peer.address;
  line.node = peer.node;
  line.code = name_of(why.code);
  line.reason = why.message;
  outputs.push(std::move(line));
}

Result<Nothing> ask_for_renewal(Link& link, const Renew& renew, Outputs& outputs, const Now& now) {
  if (auto admitted = link.login.admit_renewal(now); !admitted) return admitted;
  outputs.push(Authenticate{link.connection()->id(),
                            link.peer().address,
                            renew.method,
                            {renew.credential.begin(), renew.credential.end()},
                            link.login.identity().name,
                            true});
  return Nothing{};
}

bool take_renewal(Link& link, const Authenticated& answer, Outputs& outputs, const Now& now) {
  std::string why = refusal(answer, now);
  if (why.empty() &&
      answer.identity->name != link.login.identity().name)  // mutant: renewal_identity
    why = "it is another identity's";
  link.send(Renewed{why.empty()});
  if (!why.empty()) {
    log_renewal(link, LogLevel::kWarn, "the new login of " + link.label() + " is refused: " + why,
                outputs, now);
    audit(outputs, link, AuditEvent::kRenewalRefused, why);
    return false;
  }
  const bool other_groups = answer.identity->groups != link.login.identity().groups;
  link.login.set_identity(*answer.identity);
  check_expiry(link, now);
  log_renewal(link, LogLevel::kInfo,
              link.label() + " has renewed its login as " + answer.identity->name, outputs, now);
  audit_login(outputs, link, AuditEvent::kRenewed);
  return other_groups;
}

const IdentitiesChanged::Change* change_of(const Link& link, const IdentitiesChanged& changed) {
  const Identity& identity = link.login.identity();
  if (identity.credential.empty()) return nullptr;
  const auto change =
      std::find_if(changed.changes.begin(), changed.changes.end(),
                   [&](const auto& c) { return c.credential == identity.credential; });
  return change == changed.changes.end() ? nullptr : &*change;
}

bool take_change(Link& link, const IdentitiesChanged& changed, Outputs& outputs, const Now& now) {
  const IdentitiesChanged::Change* const change = change_of(link, changed);
  if (!change) return false;
  const Identity& identity = link.login.identity();
  if (change->identity) {
    link.login.set_identity(*change->identity);
    audit_login(outputs, link, AuditEvent::kRightsChanged);
    check_expiry(link, now);
    return true;
  }
  audit(outputs, link, AuditEvent::kRevoked, "the login method withdrew the login");
  link.fail({CloseCode::kRevoked,
             "the login of " + identity.name + " was withdrawn"});  // mutant: login_withdrawn
  if (!link.connection()) link.life.give_up(now);
  return false;
}

void check_expiry(Link& link, const Now& now) {
  if (!link.open()) return;
  switch (link.login.check_expiry(link.connection()->peer().expires, now)) {
    case LinkLogin::Expired::kNothing: return;
    case LinkLogin::Expired::kLogin:
      return link.fail(
          {CloseCode::kExpired, "the login of " + link.login.identity().name + " has expired"});
    case LinkLogin::Expired::kCertificate:
      return link.fail(
          {CloseCode::kExpired, "the certificate of " + link.label() + " has expired"});
  }
}

// A client that closes in order needs no place any more. A server that does so is mostly restarted:
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

// After a change of the network silence shows earlier than dead_after: the peer may still be there.
Loss loss_by(const Error& ours, const Link& link, const Now& now) {
  if (ours.code == CloseCode::kRevoked) return Loss::kEnd;
  const bool silent = ours.code == CloseCode::kSilent && now.steady >= link.connection()->dead_at();
  return silent ? Loss::kSilence : Loss::kBreak;
}

bool is_orderly(const ConnectionClosed& closed) {
  return is(closed.code, CloseCode::kGoingAway) && closed.reason == kPeerStops;
}

// The reason in the peer's close frame may be any bytes.
Failure failure_of(const ConnectionClosed& closed) {
  const Cause cause = closed.code ? cause_of(static_cast<CloseCode>(*closed.code)) : closed.cause;
  if (is_orderly(closed)) return {cause, kPeerStops};
  const std::string said = to_text(closed.reason, kReasonBytesMax);
  if (said.empty()) return {cause, "the connection was closed"};
  return {cause, (closed.code ? "it says: " : "") + said};
}

DialFailure wait_after(Cause cause) {
  switch (cause) {
    case Cause::kLoginRefused:
    case Cause::kRevoked:
    case Cause::kVersion: return DialFailure::kRefused;
    case Cause::kTooManyConnections:
    case Cause::kLoginNotJudged: return DialFailure::kPutOff;
    case Cause::kOtherKey: return DialFailure::kOtherKey;
    // Somebody is there, but not a server that takes us.
    case Cause::kServerSilent:
    case Cause::kRobotNotAtRelay:
    case Cause::kNameNotServed:
    case Cause::kHttpLogin:
    case Cause::kPlainToTlsPort:
    case Cause::kTlsToPlainPort:
    case Cause::kCertificateEarly:
    case Cause::kCertificateExpired:
    case Cause::kCertificateName:
    case Cause::kCertificateForeign:
    case Cause::kCertificatePurpose:
    case Cause::kClientCertificate:
    case Cause::kTlsFails:
    case Cause::kPathWrong:
    case Cause::kCaptivePortal:
    case Cause::kProxyWithoutServer:
    case Cause::kProxyWithoutUpgrade:
    case Cause::kNotThisProgram: return DialFailure::kAnswered;
    default: return DialFailure::kGone;
  }
}

std::string advice(Cause cause) {
  switch (cause) {
    case Cause::kLoginRefused:
    case Cause::kRevoked:
      return "; the server's log says why. The next try follows after 5 s, later ones up to "
             "a minute apart; where the credential is in a file, a new one there is used at once";
    case Cause::kVersion: return "; one of the two sides needs another version of ROS2 Connect";
    case Cause::kExpired:
      return "; another credential is needed: where it is in a file, a new one there is used at "
             "once";
    default: return {};
  }
}

bool is_successor(const Link& newer, const Link& older) {
  const std::string& name = newer.login.identity().name;
  return !name.empty() && newer.id > older.id && newer.peer().side != older.peer().side &&
         newer.peer().node == older.peer().node && name == older.login.identity().name;
}

bool is_replaced(const Link& link, const Peer& peer) {
  return link.peer().side && link.peer().side != peer.side;
}

std::string past_of(const Link& link, const Peer& peer, bool resumes) {
  if (is_replaced(link, peer)) return "; it was started again";
  if (link.life.connects() == 0) return "";
  if (link.login.session() == peer.session) return "; it resumes after a break";
  if (link.life.outlasted()) return "; the break was longer than resume.seconds";
  if (resumes) return "; the server has not kept what was under way";
  return "; it starts again, nothing had to be kept";
}

}  // namespace connect_bridge
