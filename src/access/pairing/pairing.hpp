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

// A client that logs in with a code and then uses the token that it has made.
struct Joining {
  std::string credential;  // for the login method "pair"
  Bytes token;
  std::function<std::string()> keep;  // called after the login; returns what is wrong, or nothing
  std::string made_by;                // the command that makes an invitation like its own
};

// What a program starts with. Without a pairing: what was given.
struct Start {
  std::vector<std::string> problems;
  std::vector<std::string> news;  // for the log
  ParameterMap parameters;
  // Where further parameters come from, now or after the first login.
  std::optional<PairingFolder> folder;
  // Server: stores the parameters for the next start, after this one has succeeded: where it
  // listens, or with a relay's line where that has let it in. Returns what is wrong, or nothing.
  std::function<std::string()> keep;
  std::optional<Invitation> invitation;  // server: to be printed; its URL may have no port
  std::vector<std::string> groups;       // of the client that is invited
  // The server of this folder that runs already: it takes the client, this process starts nothing.
  std::optional<RunningServer> running;
  std::optional<Joining> joining;  // client
  std::string relay_code;          // server: of the relay's line (RelayOptions::code)
};

// Which end is the robot, as start_with() will have it; it reads files and makes none.
[[nodiscard]] Role robot_end(const ParameterMap& given, const Arguments& arguments,
                             const std::string& node);

// Makes files if the arguments request a pairing; reads those of an earlier one if the parameters
// have neither address nor login. `node`: full name.
[[nodiscard]] Start start_with(const ParameterMap& given, const Arguments& arguments,
                               const std::string& node);

// Opens the pairing of an invitation at the server, this one or the one that runs already. Returns
// what is wrong, or nothing.
[[nodiscard]] std::string invite(const Start& start);

// What a client says that has shown an invitation and whose connection the server has closed with
// this code. Empty: its login was not refused, so it tries again.
[[nodiscard]] std::string refused_invitation(const Joining& joining,
                                             std::optional<std::uint16_t> close_code);

}  // namespace connect_bridge
