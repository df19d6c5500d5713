// Judges logins on threads of its own, because that may block and the loop must not.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "auth/authenticator.hpp"
#include "auth/credential.hpp"
#include "core/ports/ports.hpp"

namespace connect_bridge {

// Server: judges logins in the order in which they come, and follows changes of the login method
// for open links. Client: follows the file of its credential. Results come in a valid order: a
// login that was judged before its token was withdrawn is reported before the withdrawal. The
// results are given to the ports, which are called from the desk's threads.
class LoginDesk {
 public:
  // More than the connections without a login that the core keeps, and renewals of as many links.
  static constexpr std::size_t kWaitingMax = 1024;

  struct Options {
    Authenticator* authenticator = nullptr;  // null: no logins are judged here; outlives the desk
    std::optional<CredentialFile> credential_file;
    Duration time_limit{};  // a login that has waited so long is refused without being judged
  };
  struct Ports {
    std::function<void(Input&&)> input;
    std::function<void(Log&&)> log;
  };

  LoginDesk(Options options, Ports ports);
  // Waits for logins that are being judged, forgets those that wait.
  ~LoginDesk();
  LoginDesk(const LoginDesk&) = delete;
  LoginDesk& operator=(const LoginDesk&) = delete;

  // The result comes as an Authenticated. False: too many wait. Any thread.
  [[nodiscard]] bool ask(Authenticate request);

 private:
  struct Waiting {
    Authenticate request;
    std::chrono::steady_clock::time_point since;
  };

  void judge_all();
  void judge(Waiting next);
  void look_around();
  void tell(Refreshed&& refreshed);
  void tell(Credential&& credential);

  Options options_;
  const Ports ports_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Waiting> waiting_;
  bool ending_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace connect_bridge
