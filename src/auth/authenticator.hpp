// Who is at the other end? The question that a login asks, and the methods that answer it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/bytes.hpp"
#include "core/base/time.hpp"
#include "core/policy/policy.hpp"

namespace connect_bridge {

struct Attempt {
  std::string method;  // "token", "none"
  Bytes credential;
  std::string peer;  // "203.0.113.5:51234"
};

// The identity, or nullopt with a reason that is for our log only (the peer learns nothing).
using Verdict = std::function<void(std::optional<Identity>, std::string reason)>;

// One login method. Thread: the loop's. The verdict is called exactly once, from inside check() or
// later, also when the connection is gone by then.
class Authenticator {
 public:
  virtual ~Authenticator() = default;
  virtual void check(const Attempt& attempt, const Now& now, Verdict verdict) = 0;
};

struct AuthOptions {
  std::string method = "token";  // "token" or "none"
  std::string token;             // one token for everybody who has it
  std::string token_file;        // YAML with several, or one token
};

// The method with its problems instead, each naming the file, line and key. Never both.
struct AuthSetup {
  std::unique_ptr<Authenticator> authenticator;
  std::vector<std::string> problems;
  std::vector<std::string> warnings;
};

// Reads files; at start only.
[[nodiscard]] AuthSetup make_authenticator(const AuthOptions& options, const Now& now);

}  // namespace connect_bridge
