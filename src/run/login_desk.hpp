// Judges logins on its own threads, because a login method may block and the loop must not.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "access/login/authenticator.hpp"
#include "access/login/credential.hpp"
#include "core/base/turns.hpp"
#include "core/ports/ports.hpp"
#include "run/unread_files.hpp"

namespace connect_bridge {

// Server: judges logins, and reports changes of the login method for open links. Client: reports
// changes of its credential file.
//
// Unauthenticated connections can send logins as fast as they like, and a method may take long
// for each. So renewals of open links come first. New logins take turns by customer, renewals by
// identity (Authenticate::turn).
//
// Results come in a valid order: a login that was judged before its token was withdrawn is
// reported before the withdrawal. The desk's threads call the ports.
class LoginDesk {
 public:
  // Limit of logins that wait, and of renewals: more than the core keeps, which forgets closed
  // connections.
  static constexpr std::size_t kWaitingMax = 1024;
  // Renewals in a row while other logins wait: clients with a token do not block new logins.
  static constexpr int kRenewalsInARow = 3;

  struct Options {
    Authenticator* authenticator = nullptr;  // null: this desk judges no logins; outlives the desk
    std::optional<CredentialFile> credential_file;
    Duration time_limit{};  // older logins are refused without being judged
    // Waiting logins with one turn: as many as a loopback address may have unauthenticated
    // connections.
    std::size_t of_one_max = 128;
    Duration refresh_period = std::chrono::seconds(1);
  };
  struct Ports {
    std::function<void(Input&&)> input;
    std::function<void(Log&&)> log;
  };

  LoginDesk(Options options, Ports ports);
  // Waits for logins that are being judged, and forgets the waiting ones.
  ~LoginDesk();
  LoginDesk(const LoginDesk&) = delete;
  LoginDesk& operator=(const LoginDesk&) = delete;

  // The result is an Authenticated input, also if too many logins wait. Any thread.
  void ask(Authenticate request);
  // Drops the login of a closed connection, if it is not being judged yet. Any thread.
  void cancel(ConnectionId connection);
  // Whether files that decide beside the login method's cannot be read now, since descriptors or
  // memory are lacking. Any thread.
  void set_lacks_means(bool lacks) { others_lack_means_ = lacks; }
  // Why the files of logins as they are now are not used; empty: they are. Any thread.
  [[nodiscard]] std::vector<std::string> refused_files();

 private:
  struct Waiting {
    Authenticate request;
    std::chrono::steady_clock::time_point since;
  };

  [[nodiscard]] bool anybody_waits() const { return !renewals_.empty() || !strangers_.empty(); }
  [[nodiscard]] std::optional<Waiting> take_next();
  // The body of a thread: judges waiting logins. `refreshes`: it also does the periodic refresh.
  void work(bool refreshes);
  void judge(Waiting next);
  void refuse(ConnectionId connection, const std::string& why);
  void refresh();
  void keep_refused(std::string problem);
  void tell(Refreshed&& refreshed);
  void tell(Credential&& credential);

  Options options_;
  const Ports ports_;
  std::mutex mutex_;
  std::condition_variable changed_;
  Turns<std::string, Waiting> renewals_{{kWaitingMax, kWaitingMax}};
  Turns<std::string, Waiting> strangers_{{kWaitingMax, options_.of_one_max}};
  int renewals_in_a_row_ = 0;
  std::string refused_;  // why the files as they are now are not used; empty: they are
  std::atomic<bool> others_lack_means_ = false;
  UnreadFiles unread_files_;  // counted by the thread that refreshes
  bool ending_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace connect_bridge
