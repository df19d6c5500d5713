// Judges logins on threads of its own, because that may block and the loop must not.
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

namespace connect_bridge {

// Server: judges logins, and follows changes of the login method for open links. Client: follows
// the file of its credential. Strangers can make logins as fast as they like, and a method may take
// long for each: so open links renew theirs first, and customers take turns, as do the identities
// that renew. Results come in a valid order: a login that was judged before its token was withdrawn
// is reported before the withdrawal. Where a file that decides has changed, and descriptors or
// memory to read it are lacking for kRefreshesInTheDark refreshes, strangers are refused until it
// is read: a withdrawal may stand there. The results are given to the ports, which are called from
// the desk's threads.
class LoginDesk {
 public:
  // Strangers, and renewals as well: more than the core keeps, which forgets those that leave.
  static constexpr std::size_t kWaitingMax = 1024;
  // Renewals in a row while strangers wait: clients with a token do not keep them out either.
  static constexpr int kRenewalsInARow = 3;
  static constexpr int kRefreshesInTheDark = 10;

  struct Options {
    Authenticator* authenticator = nullptr;  // null: no logins are judged here; outlives the desk
    std::optional<CredentialFile> credential_file;
    Duration time_limit{};  // a login that has waited so long is refused without being judged
    // Logins of one customer that may wait: as many as an address of the loopback may have
    // connections without a login.
    std::size_t of_one_max = 128;
    Duration refresh_period = std::chrono::seconds(1);
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

  // The result comes as an Authenticated, also where too many wait. Any thread.
  void ask(Authenticate request);
  // Its connection is gone: it is not judged, if that has not begun. Any thread.
  void cancel(ConnectionId connection);
  // Whether files that decide beside the login method's cannot be read now, since descriptors or
  // memory are lacking. Any thread.
  void set_lacks_means(bool lacks) { others_lack_means_ = lacks; }

 private:
  struct Waiting {
    Authenticate request;
    std::chrono::steady_clock::time_point since;
  };

  [[nodiscard]] bool anybody_waits() const { return !renewals_.empty() || !strangers_.empty(); }
  [[nodiscard]] std::optional<Waiting> take_next();
  // A thread: judges who waits. `refreshes`: it also does the periodic refresh.
  void work(bool refreshes);
  void judge(Waiting next);
  void refuse(ConnectionId connection, const std::string& why);
  void refresh();
  void tell(Refreshed&& refreshed);
  void count_refreshes_in_the_dark(bool lacks_means);
  void tell(Credential&& credential);

  Options options_;
  const Ports ports_;
  std::mutex mutex_;
  std::condition_variable changed_;
  Turns<std::string, Waiting> renewals_{{kWaitingMax, kWaitingMax}};
  Turns<std::string, Waiting> strangers_{{kWaitingMax, options_.of_one_max}};
  int renewals_in_a_row_ = 0;
  std::atomic<bool> others_lack_means_ = false;
  int in_the_dark_ = 0;                    // refreshes in a row; of the thread that refreshes
  std::atomic<bool> refuses_new_ = false;  // since there were so many
  bool ending_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace connect_bridge
