#include "core/link/renewal.hpp"

#include <algorithm>

#include "core/wire/login.hpp"

namespace connect_bridge {
namespace {

// Credentials that a control message can carry. Others take effect at the client's next connection.
bool is_printable(const Bytes& credential) {
  return credential.size() <= kCredentialBytesMax &&
         std::all_of(credential.begin(), credential.end(),
                     [](std::uint8_t c) { return c > 0x20 && c < 0x7f; });
}

}  // namespace

void Renewal::change(CredentialChanged next, Link* link) {
  if (!next.method.empty()) method_ = std::move(next.method);
  credential_ = std::move(next.credential);
  if (link && link->open()) ask(*link);
}

void Renewal::on_open(Link& link) {
  again_ = false;
  if (dialed_with_ != credential_) ask(link);
}

void Renewal::ask(Link& link) {
  if (link.login.renewing()) {
    again_ = true;
    return;
  }
  if (!is_printable(credential_)) return;
  link.login.begin_renewal();
  link.send(Renew{method_, {credential_.begin(), credential_.end()}});
}

void Renewal::on_renewed(Link& link, bool accepted) {
  if (!link.login.end_renewal()) return;
  if (accepted) {
    outputs_.log(LogLevel::kInfo, "renewed the login at " + link.label() + "; the link stays open");
  } else {
    outputs_.log(LogLevel::kWarn, link.label() +
                                      " refuses the new credential: the link stays open until the "
                                      "former one expires or is withdrawn");
  }
  if (std::exchange(again_, false)) ask(link);
}

}  // namespace connect_bridge
