// The identity of a link's peer by its login, its time limit, and the secret by which the link goes
// on.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "core/base/ids.hpp"
#include "core/base/pace.hpp"
#include "core/base/result.hpp"
#include "core/base/time.hpp"
#include "core/policy/policy.hpp"

namespace connect_bridge {

// The login outlives connections, as the link does. The peer of a client, the server, has the
// identity that its certificate or key stands for. Single-threaded.
class LinkLogin {
 public:
  enum class Expired : std::uint8_t { kNothing, kLogin, kCertificate };

  // ---- the identity
  [[nodiscard]] const Identity& identity() const { return identity_; }
  // A login or its renewal was accepted, or the login method reports a change.
  void set_identity(Identity identity) { identity_ = std::move(identity); }
  // Client: this server carries the link from now on. True: rules may treat it differently.
  [[nodiscard]] bool take_server(const Identity& server) {
    const bool other = server.name != identity_.name || server.groups != identity_.groups;
    identity_ = server;
    return other;
  }
  // A connection of the link was closed for an offence.
  void note_offence() { offended_ = true; }
  [[nodiscard]] bool has_offended() const { return offended_; }

  // ---- the session: a secret of both sides that names the link
  [[nodiscard]] const Token128& session() const { return session_; }
  void set_session(const Token128& session) { session_ = session; }
  // Does a login continue the link? A session is no credential: it continues only a link of its own
  // identity.
  [[nodiscard]] bool is_continued_by(const Token128& session, const Identity& identity) const {
    return session && session == session_ && identity.name == identity_.name;
  }

  // ---- a new login on the open connection: one at a time
  [[nodiscard]] bool renewing() const { return renewing_; }
  // Client: it sends the renewal.
  void begin_renewal() { renewing_ = true; }
  // Server: the client renews. Errors: kIllegal while a renewal is unanswered, kTooLarge when the
  // client renews too often.
  Result<Nothing> admit_renewal(const Now& now) {
    if (renewing_) return Error{CloseCode::kIllegal, "a renewal before the last was answered"};
    if (!renewals_.take(now.steady))
      return Error{CloseCode::kTooLarge, "renews its login too often"};  // mutant: renewals_pace
    renewing_ = true;
    return Nothing{};
  }
  // The answer is here, or will not come. False: there was no renewal.
  bool end_renewal() { return std::exchange(renewing_, false); }

  // When the login ends, by the system clock: with the certificate, if that ends earlier. A peer
  // that has shown a certificate has no identity without it, whatever the login method answers. 0:
  // never.
  [[nodiscard]] Stamp end(Stamp certificate) const {
    const Stamp login = identity_.expires;
    return certificate != 0 && (login == 0 || certificate < login) ? certificate : login;
  }
  // The part that has expired; if none has, deadline() is the time of the next check.
  // `certificate`: when the peer's certificate expires, by the system clock; 0: never.
  [[nodiscard]] Expired check_expiry(Stamp certificate, const Now& now) {
    expires_at_.reset();
    const Stamp expires = end(certificate);
    if (expires == 0) return Expired::kNothing;
    if (now.system >= expires)  // mutant: login_expiry
      return expires == identity_.expires ? Expired::kLogin : Expired::kCertificate;
    // By the steady clock; if the system clock was set, the next check notices that.
    expires_at_ = now.steady + Duration(expires - now.system);
    return Expired::kNothing;
  }
  [[nodiscard]] std::optional<TimePoint> deadline() const { return expires_at_; }

  // The connection is gone.
  void lost() {
    renewing_ = false;
    expires_at_.reset();
  }

 private:
  Identity identity_;
  Token128 session_;
  bool offended_ = false;
  bool renewing_ = false;
  Pace renewals_{16, std::chrono::seconds(1)};
  std::optional<TimePoint> expires_at_;
};

}  // namespace connect_bridge
