// The values that a bridge is made from.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "access/login/authenticator.hpp"
#include "access/login/credential.hpp"
#include "access/pairing/pairing.hpp"
#include "config/config.hpp"
#include "core/side/side.hpp"
#include "net/websocket/network.hpp"

namespace connect_bridge {

// The parts of a bridge, which are checked before anything is opened.
struct BridgeParts {
  Config config;
  SideOptions side;
  std::unique_ptr<Authenticator> authenticator;   // server
  bool certificate_login = false;                 // server: used in place of an authenticator
  std::optional<CredentialFile> credential_file;  // client with its token in a file
  DialOptions dial;                               // client
  std::optional<Joining> joining;                 // client during a pairing
  std::optional<PairingFolder> folder;            // the pairing's files
  ListenOptions listen;                           // server
  SocketOptions sockets;
  std::string notify_socket;  // the supervisor's socket; empty: none
};

}  // namespace connect_bridge
