// Pairing: a server and a client come to know each other without a file that anybody edits
// (docs/security.md, "Pairing").
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "auth/authenticator.hpp"
#include "core/base/bytes.hpp"
#include "core/base/parameter.hpp"
#include "run/arguments.hpp"
#include "run/invitation.hpp"

namespace connect_bridge {

// A client that logs in by a code and goes on with the token that it has made.
struct Joining {
  std::string credential;  // of the login method "pair"
  Bytes token;
  std::function<std::string()> keep;  // once it is logged in; returns what is wrong, or nothing
};

// What a program starts with. Without a pairing: what was given.
struct Start {
  std::vector<std::string> problems;
  std::vector<std::string> news;  // for the log
  ParameterMap parameters;
  std::optional<PairingOptions> pairing;  // server
  // Server: for the next start, once this one has succeeded; returns what is wrong, or nothing.
  std::function<std::string()> keep;
  std::optional<Invitation> invitation;  // server: to be printed; its URL may lack the port
  std::optional<Joining> joining;        // client
};

// Makes files where the arguments ask for a pairing, reads those of an earlier one where the
// parameters do not tell more. `node`: full name.
[[nodiscard]] Start start_with(const ParameterMap& given, const Arguments& arguments,
                               const std::string& node);

// What the server prints for the person who is to start the client. `port`: where it listens.
[[nodiscard]] std::string invitation_text(Invitation invitation, std::uint16_t port);

}  // namespace connect_bridge
