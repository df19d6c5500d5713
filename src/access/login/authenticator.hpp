// Login methods: each decides who the peer is.
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

// One attempt to log in.
struct Attempt {
  std::string method;  // "token", "jwt", "none" ...
  Bytes credential;
  std::string peer;  // "203.0.113.5:51234"
};

// The identity, or the reason of a refusal. The reason is for our log only: the peer does not get
// it.
struct Judgement {
  std::optional<Identity> identity;
  std::string reason;
  bool judged = true;  // false: the method could not decide; that counts against nobody
};

// Changes since the last refresh: for the open links, and for the log.
struct Refreshed {
  std::vector<IdentitiesChanged::Change> changes;
  std::vector<std::string> news;      // updates
  std::vector<std::string> warnings;  // facts that an operator should know before something fails
  std::vector<std::string> problems;  // reasons why nothing was updated: the old state stays valid
  // Descriptors or memory are lacking, still or for the first time, to read a changed file that
  // decides on logins.
  bool lacks_means = false;
};

// One login method. A call may block, so the threads that call it are its own, never the loop's.
class Authenticator {
 public:
  virtual ~Authenticator() = default;
  // Judges one attempt. Several threads call it at once if threads() allows it. `now` is the system
  // clock.
  [[nodiscard]] virtual Judgement judge(const Attempt& attempt, Stamp now) = 0;
  // Called once a second; with a single thread, by the one that also judges.
  [[nodiscard]] virtual Refreshed refresh(Stamp) { return {}; }
  // Number of threads that may judge at the same time, so that a slow judgement does not delay
  // others.
  [[nodiscard]] virtual unsigned threads() const { return 1; }
};

inline constexpr std::chrono::minutes kPairingTime{10};

// Options of pairing: the server pairs with one client for each code that is put into a file
// (write_invited()).
struct PairingOptions {
  std::string file;        // in a folder that only this process's user may write to
  std::string shown = {};  // file that may show the code to a person, while the code is of use
  std::chrono::steady_clock::duration lifetime = kPairingTime;  // of a code
  bool strict_modes = true;                                     // as in LoginOptions
  // Clients that pair are robots: an identity must be able to stand before names (is_prefix_word).
  bool of_robots = false;
  std::vector<std::string> taken = {};  // identities in rules, which pairing gives to nobody
};

struct AuthOptions : LoginOptions {
  std::optional<PairingOptions> pairing;  // with `token_file`, which may then have no entry
  // Group whose tokens work once, so that their early expiry needs no warning. Empty: there is
  // none.
  std::string once = {};
};

// The method, or its problems, each with the file, line and key. Never both.
struct AuthSetup {
  std::unique_ptr<Authenticator> authenticator;
  std::vector<std::string> problems;
  std::vector<std::string> warnings;
  Cause cause = Cause::kValueWrong;  // of the problems
};

// Makes the login method. Reads files; called at start only.
[[nodiscard]] AuthSetup make_authenticator(const AuthOptions& options, Stamp now);

}  // namespace connect_bridge
