// What a client logs in with, and how an open link goes on with another credential.
#pragma once

#include <string>
#include <utility>

#include "core/link/link.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// A client's. The server looks at one renewal after the other (docs/protocol.md, "Login"). Not
// thread-safe.
class Renewal {
 public:
  Renewal(std::string method, Bytes credential, Outputs& outputs)
      : method_(std::move(method)), credential_(std::move(credential)), outputs_(outputs) {}

  [[nodiscard]] const std::string& method() const { return method_; }
  [[nodiscard]] const Bytes& credential() const { return credential_; }
  // From now on this one counts; without a method that of before. `link` is told at once if it is
  // open; may be null.
  void change(CredentialChanged next, Link* link);
  // A connection of the link begins; it was logged in by the credential of then.
  void on_dialed() { dialed_with_ = credential_; }
  // It is open: the server is told what has changed since it was dialed.
  void on_open(Link& link);
  // The server's answer.
  void on_renewed(Link& link, bool accepted);

 private:
  void ask(Link& link);

  std::string method_;
  Bytes credential_;
  Bytes dialed_with_;
  bool again_ = false;  // it has changed while the server looked at the one before
  Outputs& outputs_;
};

}  // namespace connect_bridge
