// Decides which events of the audit log get a line.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/base/address_paces.hpp"
#include "core/base/pace.hpp"
#include "core/base/time.hpp"
#include "core/ports/audit.hpp"

namespace connect_bridge {

// Kinds of lines that do not take each other's place in the log.
enum class AuditRank : std::uint8_t {
  kOwn,        // of this side
  kCalls,      // calls and goals
  kRefusals,   // refused calls and goals
  kLogins,     // of a link: its login, changes of that, its end
  kChannels,   // offered, declined, demanded
  kStrangers,  // unauthenticated connections, all together
};

[[nodiscard]] AuditRank rank_of(const Audit& line);
// The rank's word in docs/security.md.
[[nodiscard]] const char* word_of(AuditRank rank);

// Peers cause most lines, as often as they like. So each identity has a pace for each rank, and a
// share of the room for lines of that rank that wait for the disk. Unauthenticated connections
// share two paces: one for networks that had a few lines lately, and one for all, of which a
// network gets half. Lines beyond that are left out and counted. Pure; not thread-safe.
class AuditBook {
 public:
  // Room for the waiting lines of a rank. An identity gets no more than it leaves free, so half of
  // it alone, and a third beside another one; and always kSureMax.
  static constexpr std::size_t kWaitingMax = 16'384;
  static constexpr std::size_t kSureMax = 64;
  static constexpr std::size_t kAccountsMax = 4096;  // further identities share one per rank
  static constexpr Duration kTellPeriod = std::chrono::seconds(10);

  // The account of an identity in one rank; stays while a line of it waits.
  struct Account {
    AuditRank rank;
    Pace pace;
    std::size_t waiting = 0;
    std::uint64_t left_out = 0;
    TimePoint logged_at{};
  };
  // The account of a line that waits from now on, until written(). Null: the line is left out,
  // because of its pace or because it may not wait.
  [[nodiscard]] Account* take(const Audit& line, TimePoint now, bool may_wait = true);
  // One line of the account is in the file.
  void written(Account& account);

  // Number of lines of one identity and rank that were left out.
  struct LeftOut {
    std::string identity;
    AuditRank rank = AuditRank::kOwn;
    std::uint64_t lines = 0;
    // Unauthenticated connections: lines by network, those of further networks under "others".
    std::map<std::string, std::uint64_t> networks = {};
  };
  // Counts of lines that were left out and are not in the log yet; each identity and rank at most
  // once in kTellPeriod. `all`: also before that time, at the end.
  [[nodiscard]] std::vector<LeftOut> take_left_out(TimePoint now, bool all = false);

 private:
  using Key = std::pair<AuditRank, std::string>;  // rank and identity
  [[nodiscard]] Account& account_of(const Audit& line);
  [[nodiscard]] bool has_turn(Account& account, const Audit& line, TimePoint now);
  [[nodiscard]] bool has_stranger_turn(Account& account, const std::string& network, TimePoint now);
  void forget_networks(TimePoint now);

  // Lines of a network that come before those of networks that had as many.
  static constexpr int kFirstLines = 5;
  static constexpr Duration kLately = std::chrono::minutes(10);
  static constexpr std::size_t kNetworksMax = 4096;
  static constexpr std::size_t kNetworksShown = 16;
  struct OfNetwork {
    int lines = 0;
    TimePoint last{};
  };

  AddressPaces strangers_{30, std::chrono::seconds(8)};
  Pace first_lines_{50, std::chrono::seconds(4)};
  std::map<std::string, OfNetwork> networks_;
  std::map<std::string, std::uint64_t> left_out_of_;  // by network, since it was logged
  TimePoint forgot_at_{};
  std::map<Key, Account> accounts_;
  std::map<AuditRank, std::size_t> waiting_;  // lines
};

}  // namespace connect_bridge
