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

// The parts of a bridge; checked before anything is opened.
struct BridgeParts {
  Config config;
  SideOptions side;
  std::unique_ptr<Authenticator> authenticator;   // server
  bool certificate_login = false;                 // server: in place of an authenticator
  std::optional<CredentialFile> credential_file;  // client whose token is in a file
  DialOptions dial;                               // client
  std::optional<Joining> joining;                 // client that pairs
  std::optional<PairingFolder> folder;            // of a pairing
  ListenOptions listen;                           // server
  SocketOptions sockets;
  std::string notify_socket;  // of the supervisor; or empty
};

}  // namespace connect_bridge
