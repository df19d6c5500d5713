#include "core/link/link_login.hpp"

namespace connect_bridge {

Result<Nothing> LinkLogin::admit_renewal(const Now& now) {
  if (renewing_) return Error{CloseCode::kIllegal, "a renewal before the last was answered"};
  if (!renewals_.take(now.steady))
    return Error{CloseCode::kTooLarge, "renews its login too often"};  // mutant: renewals_pace
  renewing_ = true;
  return Nothing{};
}

LinkLogin::Expired LinkLogin::check_expiry(Stamp certificate, const Now& now) {
  expires_at_.reset();
  // Whatever the login method says, who has shown a certificate is nobody without it.
  const Stamp login = identity_.expires;
  const bool is_sooner = certificate != 0 && (login == 0 || certificate < login);
  const Stamp expires = is_sooner ? certificate : login;
  if (expires == 0) return Expired::kNothing;
  if (now.system >= expires)
    return is_sooner ? Expired::kCertificate : Expired::kLogin;  // mutant: login_expiry
  // By the steady clock; when the other one was set, it is found out at the next look.
  expires_at_ = now.steady + Duration(expires - now.system);
  return Expired::kNothing;
}

void LinkLogin::lost() {
  renewing_ = false;
  expires_at_.reset();
}

}  // namespace connect_bridge
