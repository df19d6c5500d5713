// The credential of a client, and the renewal of an open link's login with another one.
#pragma once

#include <string>
#include <utility>

#include "core/link/link.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// Belongs to a client. The server checks one renewal after the other (docs/protocol.md, "Login").
// Not thread-safe.
class Renewal {
 public:
  Renewal(std::string method, Bytes credential, Outputs& outputs)
      : method_(std::move(method)), credential_(std::move(credential)), outputs_(outputs) {}

  [[nodiscard]] const std::string& method() const { return method_; }
  [[nodiscard]] const Bytes& credential() const { return credential_; }
  // Uses this credential from now on; without a method the method stays. `renew` is sent at once if
  // `link` is open; it may be null.
  void change(CredentialChanged next, Link* link);
  // A connection of the link is being opened, with the present credential.
  void on_dialed() { dialed_with_ = credential_; }
  // The link is open: sends `renew` if the credential has changed since the connection began.
  void on_open(Link& link);
  // The server's answer.
  void on_renewed(Link& link, bool accepted);

 private:
  void ask(Link& link);

  std::string method_;
  Bytes credential_;
  Bytes dialed_with_;
  bool again_ = false;  // the credential changed while the server checked the former one
  Outputs& outputs_;
};

}  // namespace connect_bridge
