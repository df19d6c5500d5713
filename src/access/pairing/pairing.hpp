// Pairing: a server and a client get each other's credentials without a file to edit
// (docs/security.md, "Pairing").
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "access/login/authenticator.hpp"
#include "access/pairing/arguments.hpp"
#include "access/pairing/pairing_folder.hpp"
#include "config/invitation.hpp"
#include "core/base/bytes.hpp"
#include "core/base/parameter.hpp"

namespace connect_bridge {

// A client that logs in with a code and then with the token that it has made.
struct Joining {
  std::string credential;  // for the login method "pair"
  Bytes token;
  std::function<std::string()> keep;  // called after the login; returns the problem; empty: none
  std::string made_by;                // the command that makes such an invitation
};

// Everything that a program starts with. Without a pairing: the given parameters.
struct Start {
  std::vector<std::string> problems;
  std::vector<std::string> news;  // for the log
  ParameterMap parameters;
  // Folder of further parameters, now or after the first login.
  std::optional<PairingFolder> folder;
  // Server: stores the parameters for the next start. Called once this start has succeeded: the
  // server listens or, with a registration command, the relay has accepted it. Returns the problem;
  // empty: none.
  std::function<std::string()> keep;
  std::optional<Invitation> invitation;  // server: to be printed; its URL may have no port
  std::vector<std::string> groups;       // of the invited client
  // The running server of this folder: it takes the client, and this process starts nothing.
  std::optional<RunningServer> running;
  std::optional<Joining> joining;  // client
  std::string relay_code;          // server: from the registration command (RelayOptions::code)
};

// The robot's end, as start_with() will set it. Reads files and makes none.
[[nodiscard]] Role robot_end(const ParameterMap& given, const Arguments& arguments,
                             const std::string& node);

// Makes files if the arguments request a pairing. Reads the files of an earlier pairing if the
// parameters have neither address nor login. `node`: full name.
[[nodiscard]] Start start_with(const ParameterMap& given, const Arguments& arguments,
                               const std::string& node);

// Opens the pairing of an invitation, at this server or at the running one. Returns the problem;
// empty: none.
[[nodiscard]] std::string invite(const Start& start);

// Text for a client with an invitation whose connection the server has closed with this code.
// Empty: its login was not refused, so it tries again.
[[nodiscard]] std::string refused_invitation(const Joining& joining,
                                             std::optional<std::uint16_t> close_code);

}  // namespace connect_bridge
