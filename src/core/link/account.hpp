// Limits and counts that the links of one identity share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "core/base/budget.hpp"
#include "core/base/log_limit.hpp"
#include "core/base/logged_once.hpp"
#include "core/base/pace.hpp"
#include "core/flow/rate_limit.hpp"
#include "core/link/appearing.hpp"
#include "core/link/inflation_pace.hpp"
#include "core/link/proxy_names.hpp"
#include "core/ports/payer.hpp"

namespace connect_bridge {

struct AccountOptions {
  // Publishers and services of the identity's peers that may appear here: this many at once, then
  // one in each period. The same limit applies to subscriptions, counted separately.
  int mirrors_at_once = 512;
  Duration mirror_period = std::chrono::milliseconds(5);
  // Links that are closed for an offence: this many at once. For each further one the next login
  // waits for a period.
  int offences_at_once = 4;
  Duration offence_period = std::chrono::seconds(2);
  // Things made here for a peer that the peer takes back; kBurst seconds' worth at once. The
  // largest graph that may be offered takes back some 11,000 when all of it ends: more than ten
  // such ends may come together.
  int ends_per_second = 1000;
  // Mirrors of all peers together that may exist here: publishers; and services.
  std::uint64_t mirrors_max = 16384;
  std::uint64_t services_max = 16384;
  // Memory that all peers together may make this side hold, in bytes.
  std::uint64_t memory_bytes_max = 512ULL << 20;
};

// Limits that all identities share. Single-threaded.
struct Shares {
  explicit Shares(const AccountOptions& options)
      : memory(options.memory_bytes_max),
        places(options.mirrors_max),
        service_places(options.services_max),
        listened(kListenedMax) {}

  // Limit of topics without a publisher here that are subscribed for listeners of all peers.
  static constexpr std::uint64_t kListenedMax = 1024;

  Budget memory;
  Budget places;
  Budget service_places;
  Budget listened;
  Appearing appearing;
  // Number of identities whose limits they may use together.
  static constexpr int kInflating = 4;
  InflationPace inflation{kInflating};
};

// Limits for log lines about calls that had no answer.
struct CallLines {
  LogLimit refusals, timeouts, losses, kept;
  LogLimit waits{5, std::chrono::seconds(10)};  // one node may serve several services
};

// An account outlives its links: an identity that logs in again and again, or with many links, gets
// no more. Single-threaded.
struct Account {
  explicit Account(const AccountOptions& options = {}, Shares* all = nullptr)
      : memory(all ? &all->memory : nullptr),
        places(all ? &all->places : nullptr),
        service_places(all ? &all->service_places : nullptr),
        listened(all ? &all->listened : nullptr),
        mirrors(all ? &all->appearing : nullptr, time, options.mirrors_at_once,
                options.mirror_period),
        listeners(all ? &all->appearing : nullptr, time, options.mirrors_at_once,
                  options.mirror_period),
        offences(options.offences_at_once, options.offence_period),
        withdrawals(kBurst * options.ends_per_second,
                    Duration(std::chrono::seconds(1)) / options.ends_per_second),
        attaches(kMinute * options.ends_per_second / kAttachCost,
                 withdrawals.period() * kAttachCost),
        demands(withdrawals),
        all_(all) {}

  // Seconds whose worth may come at once.
  static constexpr int kBurst = 132;
  static constexpr int kMinute = 60;
  // An attach that needs a client costs as much as this many ends.
  static constexpr int kAttachCost = 5;

  // The longest time that an identity waits for its next login because of offences.
  static constexpr Duration kShutOutMax = std::chrono::seconds(60);
  void note_offence(const Now& now) {
    if (offences.free_at() + offences.period() <= now.steady + kShutOutMax)
      static_cast<void>(offences.reserve(now.steady));
  }

  // May a message of this size, with a body of so many bytes, be decompressed now? If so, its
  // growth beyond the usual is counted.
  [[nodiscard]] bool may_inflate(std::uint64_t raw_bytes, std::uint64_t body_bytes, TimePoint now) {
    return inflation.admit(raw_bytes, body_bytes, now, all_ ? &all_->inflation : nullptr);
  }

  std::uint64_t number = 0;                         // of this account; none: it is the only one
  const Payer time = std::make_shared<LoopTime>();  // loop time that its links have used
  Budget memory;                                    // bytes that its links hold
  Budget places;                                    // its publishers here
  Budget service_places;                            // its services here
  // Channels that its peers offer, and listeners that they report, on all links together.
  static constexpr std::uint64_t kChannelsMax = 16384;
  static constexpr std::uint64_t kListenersMax = 16384;
  Budget channels;
  Budget reported_listeners;
  Budget listened;            // topics without a publisher here that its peers subscribe to
  Budget early;               // samples for its peers that wait for the answer to an offer
  ProxyNames proxy_nodes;     // nodes here that own them
  Appearing::Line mirrors;    // its publishers and services here
  Appearing::Line listeners;  // topics that are subscribed for its peers' listeners
  Pace offences;  // for which its links were closed; it may log in only while this is free
  InflationPace inflation{1};
  // Paces `accepts` of all links together; after a restart many links come at once.
  Pace accepts{160, std::chrono::seconds(1)};
  Pace asks{64, std::chrono::milliseconds(100)};  // answered ones, of all links together
  Pace withdrawals;  // of one link: each link has a copy, as at the start
  Pace attaches;     // creating a client takes the middleware about a millisecond
  Pace demands;      // ended demands
  LogLimit lines{30, std::chrono::seconds(5)};  // of links that come and go, and renew their logins
  LogLimit declines;                            // of channels that were declined before
  CallLines calls_served;                       // served here for its peers
  CallLines calls_made;                         // made to its peers
  LoggedOnce logged;

 private:
  Shares* all_;
};

// The accounts of a side by the names of their identities. All identities without a name share one
// account.
class Accounts {
 public:
  static constexpr std::size_t kUnusedMax = 256;  // names that have no link now

  explicit Accounts(const AccountOptions& options) : options_(options), shares_(options) {}

  [[nodiscard]] std::shared_ptr<Account> of(const std::string& identity) {
    if (accounts_.size() >= kept_) forget_unused();
    auto& account = accounts_[identity];
    if (!account) {
      account = std::make_shared<Account>(options_, &shares_);
      account->number = ++last_number_;
    }
    return account;
  }
  [[nodiscard]] Appearing& appearing() { return shares_.appearing; }
  [[nodiscard]] const Appearing& appearing() const { return shares_.appearing; }
  [[nodiscard]] Budget& memory() { return shares_.memory; }
  [[nodiscard]] const Budget& memory() const { return shares_.memory; }
  void on_time(const Now& now) {
    now_ = now.steady;
    if (now_ < next_review_) return;
    // Not at each deadline: there may be many accounts.
    next_review_ = now_ + std::chrono::seconds(1);
    for (auto& [name, account] : accounts_) account->logged.on_time(now);
  }

 private:
  // Forgets unused accounts, except those that must wait for their next login or owe something.
  void forget_unused() {
    std::erase_if(accounts_, [&](const auto& entry) {
      return entry.second.use_count() == 1 && entry.second->offences.idle(now_) &&
             entry.second->inflation.idle(now_);
    });
    kept_ = accounts_.size() + kUnusedMax;
  }

  AccountOptions options_;
  Shares shares_;
  std::size_t kept_ = kUnusedMax;
  std::uint64_t last_number_ = 0;
  TimePoint now_{};          // time of the last on_time()
  TimePoint next_review_{};  // when records of lines that were logged once are next reviewed
  std::map<std::string, std::shared_ptr<Account>> accounts_;
};

}  // namespace connect_bridge
