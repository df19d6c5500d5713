// Limits of links, and what the operator sets for them.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "core/base/bytes.hpp"
#include "core/base/time.hpp"
#include "core/flow/outbox_options.hpp"
#include "core/flow/reassembly.hpp"
#include "core/link/account.hpp"
#include "core/policy/names.hpp"
#include "core/ports/net_options.hpp"

namespace connect_bridge {

struct LinkOptions {
  Role role = Role::kServer;
  std::string node = "/connect";      // fully qualified name of our node
  PeerNames names;                    // what the peers call things, and what they are called here
  std::string login_method = "none";  // client: what it logs in with
  Bytes credential;                   // client, until CredentialChanged
  // Server: until a connection has logged in; client: until it is answered. Some round trips of the
  // worst path, and the 3 s of a login service.
  Duration login_timeout = std::chrono::seconds(5);
  Duration dead_after = std::chrono::seconds(3);
  // How often a peer's clock is asked, at least every third of dead_after. Zero: so.
  Duration time_period{};
  Duration retry_min = std::chrono::milliseconds(200);  // client: first back-off
  Duration retry_max = std::chrono::milliseconds(500);  // client: longest, jitter included
  Duration dial_timeout = std::chrono::seconds(5);
  // After a loss: how long what is to resume is kept for the link's return. Zero: not at all.
  Duration resume_for{};
  std::uint32_t strangers_max = 256;  // server: connections without a login
  // Server: wrong logins of one address and of all together, beyond: answered late.
  int address_wrong_logins_at_once = 60;
  Duration address_wrong_login_period = std::chrono::seconds(1);
  int wrong_logins_at_once = 600;
  Duration wrong_login_period = std::chrono::milliseconds(100);
  std::uint32_t links_max = 64;          // server
  std::uint32_t identity_links_max = 0;  // server: of one identity with a name; 0: half of them
  // Source of session secrets; the seeded generator when empty (simulation). Give it a
  // cryptographic one.
  std::function<std::uint64_t()> secret_random;
  AccountOptions account;
  OutboxOptions outbox;
  ReassemblyOptions reassembly;
};

}  // namespace connect_bridge
