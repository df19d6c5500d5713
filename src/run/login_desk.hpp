// Where logins are looked at: threads for what may block, so that the loop does not.
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

// Server: judges logins, in the order of their coming, and follows what the login method says of
// those who are in. Client: follows the file of its credential. Answers come in an order that
// holds: a login that was judged before its token was withdrawn is told before that. The results
// are given to the ports, which are called from the desk's threads.
class LoginDesk {
 public:
  // More than the connections without a login that the core keeps, and renewals of as many links.
  static constexpr std::size_t kWaitingMax = 1024;

  struct Options {
    Authenticator* authenticator = nullptr;  // null: there are no logins here; outlives the desk
    std::optional<CredentialFile> credential_file;
    Duration time_limit{};  // a login that has waited so long is given up without a look
  };
  struct Ports {
    std::function<void(Input&&)> input;
    std::function<void(Log&&)> log;
  };

  LoginDesk(Options options, Ports ports);
  // Waits for what is being looked at, forgets what waits.
  ~LoginDesk();
  LoginDesk(const LoginDesk&) = delete;
  LoginDesk& operator=(const LoginDesk&) = delete;

  // The answer is an Authenticated. False: too many wait. Any thread.
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
