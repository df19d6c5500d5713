// What the links of one identity have together.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>

#include "core/base/budget.hpp"
#include "core/base/line_pace.hpp"
#include "core/base/log_limit.hpp"
#include "core/base/pace.hpp"
#include "core/base/tell_once.hpp"
#include "core/flow/rate_limit.hpp"

namespace connect_bridge {

struct AccountOptions {
  // Publishers and services that its peers may make appear here: so many at once, then one per
  // period. The same limit applies to subscriptions, separately.
  int mirrors_at_once = 512;
  Duration mirror_period = std::chrono::milliseconds(5);
  // Links that are ended for an offence: so many, then the next login waits for a period each.
  int offences_at_once = 4;
  Duration offence_period = std::chrono::seconds(2);
  // Publishers here of which all peers together may be the origins; and as many services.
  std::uint64_t mirrors_max = 16384;
  // What all peers together may make this side hold, in bytes.
  std::uint64_t memory_bytes_max = 512ULL << 20;
};

// It outlives the links, so that logging in again and again, or with many links, does not give
// more. Single-threaded.
struct Account {
  // Compressed messages of robots are some 2 to 20 times smaller than their samples, an empty map
  // is thousands of times. Larger ratios than 32 count, so that a few bytes a second cannot become
  // gigabytes.
  static constexpr std::uint64_t kUsualRatioMax = 32;
  static constexpr double kInflatedBytesPerSecond = 64 << 20;

  Account() : Account({}, nullptr, nullptr, nullptr) {}  // of nobody else
  Account(const AccountOptions& options, Budget* all_memory, Budget* all_places,
          Budget* all_service_places)
      : memory(all_memory),
        places(all_places),
        service_places(all_service_places),
        mirrors(options.mirrors_at_once, options.mirror_period),
        listeners(options.mirrors_at_once, options.mirror_period),
        offences(options.offences_at_once, options.offence_period) {}

  // It waits for its next login no longer than that, however often it offends.
  static constexpr Duration kShutOutMax = std::chrono::seconds(60);
  void note_offence(const Now& now) {
    if (offences.free_at() + offences.period() <= now.steady + kShutOutMax)
      static_cast<void>(offences.reserve(now.steady));
  }

  Budget memory;          // what its links hold
  Budget places;          // its publishers here
  Budget service_places;  // its services here
  Pace mirrors;
  Pace listeners;  // of its peers that are subscribed for, and shown, here
  Pace offences;   // for which its links were ended; while not free it may not log in
  Throttle inflation{kInflatedBytesPerSecond, std::chrono::seconds(1)};
  // Of `accepts`, as for each link; after a restart many links come at once.
  Throttle accepts{100, std::chrono::seconds(40)};
  // Of control messages, in bytes. Each connection is read no faster than its own rate allows; this
  // holds for those who come again and again, or with many links.
  Throttle text{8 << 20, std::chrono::seconds(64)};
  // Those that create a client, which takes the middleware about a millisecond.
  Pace attaches{12'000, std::chrono::milliseconds(5)};
  Pace demands{131'072, std::chrono::milliseconds(1)};   // that ended
  Pace describes{4096, std::chrono::milliseconds(10)};   // of types that it asks for
  Pace nodes_asked{512, std::chrono::milliseconds(50)};  // about their types, for it
  LinePace lines;                                        // of links that come and go
  LogLimit declines;                                     // of channels that were declined before
  TellOnce told;
};

// The accounts of a side by the names of their identities. All identities without a name share one
// account.
class Accounts {
 public:
  static constexpr std::size_t kUnusedMax = 256;  // names that have no link now

  explicit Accounts(const AccountOptions& options)
      : options_(options),
        memory_(options.memory_bytes_max),
        places_(options.mirrors_max),
        service_places_(options.mirrors_max) {}

  [[nodiscard]] std::shared_ptr<Account> of(const std::string& identity) {
    if (accounts_.size() >= kept_) forget_unused();
    auto& account = accounts_[identity];
    if (!account)
      account = std::make_shared<Account>(options_, &memory_, &places_, &service_places_);
    return account;
  }
  [[nodiscard]] Budget& memory() { return memory_; }
  [[nodiscard]] const Budget& memory() const { return memory_; }
  void on_time(const Now& now) {
    now_ = now.steady;
    for (auto& [name, account] : accounts_) account->told.on_time(now);
  }

 private:
  // But those who must wait for their next login.
  void forget_unused() {
    std::erase_if(accounts_, [&](const auto& entry) {
      return entry.second.use_count() == 1 && entry.second->offences.idle(now_);
    });
    kept_ = accounts_.size() + kUnusedMax;
  }

  AccountOptions options_;
  Budget memory_;
  Budget places_;
  Budget service_places_;
  std::size_t kept_ = kUnusedMax;
  TimePoint now_{};  // as of the last on_time()
  std::map<std::string, std::shared_ptr<Account>> accounts_;
};

}  // namespace connect_bridge
