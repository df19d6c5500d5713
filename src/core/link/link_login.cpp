#include "core/link/link_login.hpp"

namespace connect_bridge {

Result<Nothing> LinkLogin::admit_renewal(const Now& now) {
  if (renewing_) return Error{CloseCode::kIllegal, "a renewal before the last was answered"};
  if (!renewals_.take(now.steady))
    return Error{CloseCode::kTooLarge, "renews its login too often"};  // mutant: renewals_pace
  renewing_ = true;
  return Nothing{};
}

Stamp LinkLogin::end(Stamp certificate) const {
  const Stamp login = identity_.expires;
  return certificate != 0 && (login == 0 || certificate < login) ? certificate : login;
}

LinkLogin::Expired LinkLogin::check_expiry(Stamp certificate, const Now& now) {
  expires_at_.reset();
  const Stamp expires = end(certificate);
  if (expires == 0) return Expired::kNothing;
  if (now.system >= expires)  // mutant: login_expiry
    return expires == identity_.expires ? Expired::kLogin : Expired::kCertificate;
  // By the steady clock; when the other one was set, it is found out at the next look.
  expires_at_ = now.steady + Duration(expires - now.system);
  return Expired::kNothing;
}

void LinkLogin::lost() {
  renewing_ = false;
  expires_at_.reset();
}

}  // namespace connect_bridge
