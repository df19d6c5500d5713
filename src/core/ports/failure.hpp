// Failures as codes: for the log, the status, the audit log and `ctl doctor`.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/close_code.hpp"
#include "core/wire/words.hpp"

namespace connect_bridge {

// A cause is found where the fact is seen. Programs read the cause, and never the text beside it.
enum class Cause : std::uint8_t {
  kNone,   // nothing is wrong
  kOther,  // no cause of this list

  // ---- the way to the server
  kHostUnknown,       // no name server knows the name
  kResolverSilent,    // no name server answers
  kPortClosed,        // TCP is refused
  kNoRoute,           // this machine has no route there
  kNoAnswer,          // TCP gets no answer
  kServerSilent,      // TCP is accepted, and no answer follows
  kProxyUnreachable,  // the HTTP proxy itself: its name, address or port
  kProxySilent,       // it is there, and does not answer CONNECT
  kProxyLogin,        // it wants another login
  kProxyRefuses,      // it does not connect to the server
  kRelayUnreachable,  // the relay itself
  kRelayRefuses,      // it refuses this robot's token or line
  kRobotNotAtRelay,   // it has no such robot now
  kRobotTwice,        // another machine has the token of this robot there

  // ---- TLS
  kPlainToTlsPort,    // ws:// to a port with TLS
  kTlsToPlainPort,    // wss:// to a port without TLS
  kCertificateEarly,  // not valid yet
  kCertificateExpired,
  kCertificateName,     // it is for another name
  kCertificateForeign,  // its authority is not known, or the certificate is refused otherwise
  kCertificatePurpose,  // the server's is for clients
  kOtherKey,            // no key of tls.pin
  kClientCertificate,   // the server wants one, or another one
  kNameNotServed,       // what answers has no server of this name
  kTlsFails,            // any other failure of the handshake

  // ---- HTTP in place of a WebSocket
  kPathWrong,            // there is nothing at this path
  kCaptivePortal,        // a page answers
  kProxyWithoutServer,   // a proxy answers, and has no server behind it
  kProxyWithoutUpgrade,  // a proxy or web server does not pass on the upgrade
  kHttpLogin,            // a proxy or web server wants a login of its own, or forbids the path
  kNotThisProgram,       // another program answers

  // ---- a connection that was open
  kConnectionLost,  // TCP or TLS ended without a close code
  kAddressGone,     // this machine has lost its own address
  kClosed,          // closed with a code that is none of the protocol
  // Close codes of the protocol, under their names there.
  kNormal,
  kGoingAway,
  kVersion,
  kMalformed,
  kLoginRefused,
  kLoginTimeout,
  kReplaced,
  kTooLarge,
  kSlowPeer,
  kSilent,
  kIllegal,
  kUnknownChannel,
  kSameSide,
  kTooManyConnections,
  kExpired,
  kInternal,
  kRevoked,
  kLoginNotJudged,

  // ---- a configuration
  kKeyUnknown,        // no parameter has this name
  kValueWrong,        // a parameter has a wrong value, or contradicts another one
  kUrlWrong,          // `url`
  kPrefixWrong,       // `prefix` or `remap`
  kRuleWrong,         // `rules`, or a key of a rule
  kTokenMissing,      // there is no token that can be used
  kCertificateFiles,  // certificate, key or authorities are missing or do not fit
  kFileMissing,       // a file that is named does not exist
  kFileNotPermitted,  // this user may not read it
  kFileUnreadable,    // it cannot be read for another reason
  kFileUnwritable,
  kYamlWrong,       // a parameter file is not what ROS reads
  kSectionMissing,  // it has nothing for this program
  kFileDistrusted,  // other users may change it
  kFileReadable,    // other users may read a secret in it

  // ---- the addresses of a server
  kPortTaken,         // another program listens there
  kPortNotPermitted,  // this user may not listen there
  kAddressNotHere,    // this machine has no such address
};

inline constexpr std::array<Word<Cause>, 72> kCauseWords{{
    {Cause::kNone, ""},
    {Cause::kOther, "other"},
    {Cause::kHostUnknown, "host_unknown"},
    {Cause::kResolverSilent, "resolver_silent"},
    {Cause::kPortClosed, "port_closed"},
    {Cause::kNoRoute, "no_route"},
    {Cause::kNoAnswer, "no_answer"},
    {Cause::kServerSilent, "server_silent"},
    {Cause::kProxyUnreachable, "proxy_unreachable"},
    {Cause::kProxySilent, "proxy_silent"},
    {Cause::kProxyLogin, "proxy_login"},
    {Cause::kProxyRefuses, "proxy_refuses"},
    {Cause::kRelayUnreachable, "relay_unreachable"},
    {Cause::kRelayRefuses, "relay_refuses"},
    {Cause::kRobotNotAtRelay, "robot_not_at_relay"},
    {Cause::kRobotTwice, "robots_with_one_token"},
    {Cause::kPlainToTlsPort, "plain_to_tls_port"},
    {Cause::kTlsToPlainPort, "tls_to_plain_port"},
    {Cause::kCertificateEarly, "certificate_early"},
    {Cause::kCertificateExpired, "certificate_expired"},
    {Cause::kCertificateName, "certificate_name"},
    {Cause::kCertificateForeign, "certificate_foreign"},
    {Cause::kCertificatePurpose, "certificate_purpose"},
    {Cause::kOtherKey, "other_key"},
    {Cause::kClientCertificate, "client_certificate"},
    {Cause::kNameNotServed, "name_not_served"},
    {Cause::kTlsFails, "tls_fails"},
    {Cause::kPathWrong, "path_wrong"},
    {Cause::kCaptivePortal, "captive_portal"},
    {Cause::kProxyWithoutServer, "proxy_without_server"},
    {Cause::kProxyWithoutUpgrade, "proxy_without_upgrade"},
    {Cause::kHttpLogin, "http_login"},
    {Cause::kNotThisProgram, "not_this_program"},
    {Cause::kConnectionLost, "connection_lost"},
    {Cause::kAddressGone, "address_gone"},
    {Cause::kClosed, "closed"},
    {Cause::kNormal, "normal"},
    {Cause::kGoingAway, "going_away"},
    {Cause::kVersion, "version"},
    {Cause::kMalformed, "malformed"},
    {Cause::kLoginRefused, "login_refused"},
    {Cause::kLoginTimeout, "login_timeout"},
    {Cause::kReplaced, "replaced"},
    {Cause::kTooLarge, "too_large"},
    {Cause::kSlowPeer, "slow_peer"},
    {Cause::kSilent, "silent"},
    {Cause::kIllegal, "illegal"},
    {Cause::kUnknownChannel, "unknown_channel"},
    {Cause::kSameSide, "same_side"},
    {Cause::kTooManyConnections, "too_many_connections"},
    {Cause::kExpired, "expired"},
    {Cause::kInternal, "internal"},
    {Cause::kRevoked, "revoked"},
    {Cause::kLoginNotJudged, "login_not_judged"},
    {Cause::kKeyUnknown, "key_unknown"},
    {Cause::kValueWrong, "value_wrong"},
    {Cause::kUrlWrong, "url_wrong"},
    {Cause::kPrefixWrong, "prefix_wrong"},
    {Cause::kRuleWrong, "rule_wrong"},
    {Cause::kTokenMissing, "token_missing"},
    {Cause::kCertificateFiles, "certificate_files"},
    {Cause::kFileMissing, "file_missing"},
    {Cause::kFileNotPermitted, "file_not_permitted"},
    {Cause::kFileUnreadable, "file_unreadable"},
    {Cause::kFileUnwritable, "file_unwritable"},
    {Cause::kYamlWrong, "yaml_wrong"},
    {Cause::kSectionMissing, "section_missing"},
    {Cause::kFileDistrusted, "file_distrusted"},
    {Cause::kFileReadable, "file_readable"},
    {Cause::kPortTaken, "port_taken"},
    {Cause::kPortNotPermitted, "port_not_permitted"},
    {Cause::kAddressNotHere, "address_not_here"},
}};

// "port_closed"; of kNone nothing.
[[nodiscard]] constexpr std::string_view word_of(Cause cause) {
  return word_of(kCauseWords, cause);
}

// The cause of a close code, ours or the peer's. A number that the protocol does not have is
// kClosed.
[[nodiscard]] constexpr Cause cause_of(CloseCode code) {
  switch (code) {
    case CloseCode::kNormal: return Cause::kNormal;
    case CloseCode::kGoingAway: return Cause::kGoingAway;
    case CloseCode::kVersion: return Cause::kVersion;
    case CloseCode::kMalformed: return Cause::kMalformed;
    case CloseCode::kLoginRefused: return Cause::kLoginRefused;
    case CloseCode::kLoginTimeout: return Cause::kLoginTimeout;
    case CloseCode::kReplaced: return Cause::kReplaced;
    case CloseCode::kTooLarge: return Cause::kTooLarge;
    case CloseCode::kSlowPeer: return Cause::kSlowPeer;
    case CloseCode::kSilent: return Cause::kSilent;
    case CloseCode::kIllegal: return Cause::kIllegal;
    case CloseCode::kUnknownChannel: return Cause::kUnknownChannel;
    case CloseCode::kSameSide: return Cause::kSameSide;
    case CloseCode::kTooManyConnections: return Cause::kTooManyConnections;
    case CloseCode::kExpired: return Cause::kExpired;
    case CloseCode::kInternal: return Cause::kInternal;
    case CloseCode::kRevoked: return Cause::kRevoked;
    case CloseCode::kLoginNotJudged: return Cause::kLoginNotJudged;
  }
  return Cause::kClosed;
}

// A problem and its cause; kNone: there is no problem.
struct Failure {
  Cause cause = Cause::kNone;
  std::string text{};  // for people, made where the cause was found

  explicit operator bool() const { return cause != Cause::kNone; }
  bool operator==(const Failure&) const = default;
};

[[nodiscard]] inline std::vector<std::string> texts_of(const std::vector<Failure>& failures) {
  std::vector<std::string> texts;
  for (const Failure& failure : failures) texts.push_back(failure.text);
  return texts;
}

}  // namespace connect_bridge
