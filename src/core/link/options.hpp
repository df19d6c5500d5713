// Limits of links; the operator sets some of them.
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
  PeerNames names;                    // maps the names of peers to names here
  std::string login_method = "none";  // client: the method of its login
  Bytes credential;                   // client, until CredentialChanged
  // Time until a connection has logged in (server), or until its login is answered (client). It
  // covers some round trips of the worst path, and the 3 s of a login service.
  Duration login_timeout = std::chrono::seconds(5);
  Duration dead_after = std::chrono::seconds(3);
  // Period of requests for a peer's clock, at most a third of dead_after. Zero: a third of
  // dead_after.
  Duration time_period{};
  Duration retry_min = std::chrono::milliseconds(200);  // client: first back-off
  Duration retry_max = std::chrono::milliseconds(500);  // client: longest, jitter included
  Duration dial_timeout = std::chrono::seconds(5);
  // Time after a loss for which messages are kept for the link's return. Zero: none are kept.
  Duration resume_for{};
  std::uint32_t strangers_max = 256;  // server: unauthenticated connections
  // Server: limits for wrong logins, of one address and of all together. Further wrong logins are
  // answered late.
  int address_wrong_logins_at_once = 60;
  Duration address_wrong_login_period = std::chrono::seconds(1);
  int wrong_logins_at_once = 600;
  Duration wrong_login_period = std::chrono::milliseconds(100);
  std::uint32_t links_max = 64;          // server
  std::uint32_t identity_links_max = 0;  // server: of one named identity; 0: half of links_max
  // Source of session secrets: a cryptographic generator. Empty: the seeded generator (simulation).
  std::function<std::uint64_t()> secret_random;
  std::size_t ends_at_once = 512;          // channels or mirrors of a lost link, in one step
  std::uint64_t bytes_per_second_max = 0;  // of all links together (SideCap); 0: no limit
  AccountOptions account;
  OutboxOptions outbox;
  ReassemblyOptions reassembly;
};

}  // namespace connect_bridge
