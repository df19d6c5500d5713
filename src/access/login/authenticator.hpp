// The login methods: they find out who the peer is.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/time.hpp"
#include "core/policy/policy.hpp"
#include "core/ports/inputs.hpp"
#include "core/ports/login_options.hpp"

namespace connect_bridge {

struct Attempt {
  std::string method;  // "token", "jwt", "none" ...
  Bytes credential;
  std::string peer;  // "203.0.113.5:51234"
};

// The identity, or a reason for our log only: the peer does not get it.
struct Judgement {
  std::optional<Identity> identity;
  std::string reason;
  bool judged = true;  // false: the method could not find out; that counts against nobody
};

// What has changed since the last refresh: for the open links, and for the log.
struct Refreshed {
  std::vector<IdentitiesChanged::Change> changes;
  std::vector<std::string> news;      // what was updated
  std::vector<std::string> warnings;  // what an operator should know before it goes wrong
  std::vector<std::string> problems;  // why nothing was updated: the former state stays valid
  // A file that decides has changed, and descriptors or memory to read it are lacking, still or for
  // the first time.
  bool lacks_means = false;
};

// One login method. It may block: it is called on threads of its own, never on the loop's.
class Authenticator {
 public:
  virtual ~Authenticator() = default;
  // By several threads at once if threads() says so. `now` is the system clock.
  [[nodiscard]] virtual Judgement judge(const Attempt& attempt, Stamp now) = 0;
  // Called once a second; if there is only one thread, by the one that also judges.
  [[nodiscard]] virtual Refreshed refresh(Stamp) { return {}; }
  // How many threads may judge at the same time, so that a slow one does not delay the others.
  [[nodiscard]] virtual unsigned threads() const { return 1; }
};

inline constexpr std::chrono::minutes kPairingTime{10};

// The server pairs with one client for each code that is put into a file (write_invited()).
struct PairingOptions {
  std::string file;        // in a folder that only this process's user may write to
  std::string shown = {};  // where the code may stand for a person: goes when it is of no more use
  std::chrono::steady_clock::duration lifetime = kPairingTime;  // of a code
  bool strict_modes = true;                                     // as in LoginOptions
  // Who pairs is a robot: its identity can stand before names (is_prefix_word).
  bool of_robots = false;
  std::vector<std::string> taken = {};  // identities that nobody gets by pairing: of rules
};

struct AuthOptions : LoginOptions {
  std::optional<PairingOptions> pairing;  // with `token_file`, which may be without an entry then
  // A group whose tokens work once: that they end soon is no warning. Empty: there is none.
  std::string once = {};
};

// The method, or its problems, each with the file, line and key. Never both.
struct AuthSetup {
  std::unique_ptr<Authenticator> authenticator;
  std::vector<std::string> problems;
  std::vector<std::string> warnings;
  Cause cause = Cause::kValueWrong;  // of the problems
};

// Reads files; at start only.
[[nodiscard]] AuthSetup make_authenticator(const AuthOptions& options, Stamp now);

}  // namespace connect_bridge
