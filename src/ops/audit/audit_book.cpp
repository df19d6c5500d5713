#include "ops/audit/audit_book.hpp"

#include <array>
#include <iterator>

namespace connect_bridge {
namespace {

using std::chrono::milliseconds;

// An identity's pace in a rank. A link may have 4096 channels, which all open at once.
struct RankTraits {
  const char* word;
  Pace pace;
};
const RankTraits& traits_of(AuditRank rank) {
  static const std::array<RankTraits, 6> kTraits{{
      {"own", {100, milliseconds(1000)}},
      {"calls", {1000, milliseconds(50)}},
      {"refused_calls", {500, milliseconds(200)}},
      {"logins", {1000, milliseconds(200)}},
      {"channels", {5000, milliseconds(100)}},
      {"strangers", {100, milliseconds(2000)}},  // unauthenticated connections, all together
  }};
  return kTraits.at(static_cast<std::size_t>(rank));
}

}  // namespace

AuditRank rank_of(const Audit& line) {
  switch (line.event) {
    case AuditEvent::kStarted:
    case AuditEvent::kStopped:
    case AuditEvent::kRulesChanged:
    case AuditEvent::kRulesRefused: return AuditRank::kOwn;
    case AuditEvent::kCall:
    case AuditEvent::kGoal: return AuditRank::kCalls;
    case AuditEvent::kCallRefused: return AuditRank::kRefusals;
    case AuditEvent::kChannelOpened:
    case AuditEvent::kChannelRefused:
    case AuditEvent::kChannelEnded:
    case AuditEvent::kDemanded:
    case AuditEvent::kDemandEnded: return AuditRank::kChannels;
    case AuditEvent::kLogin:
    case AuditEvent::kRefused:
    case AuditEvent::kLinkLost:
    case AuditEvent::kRenewed:
    case AuditEvent::kRenewalRefused:
    case AuditEvent::kRightsChanged:
    case AuditEvent::kRevoked: break;
  }
  return line.link ? AuditRank::kLogins : AuditRank::kStrangers;
}

const char* word_of(AuditRank rank) {
  return traits_of(rank).word;
}

AuditBook::Account* AuditBook::take(const Audit& line, TimePoint now, bool may_wait) {
  Account& account = account_of(line);
  std::size_t& waiting = waiting_[account.rank];
  const bool has_room = account.waiting < kSureMax || account.waiting + waiting < kWaitingMax;
  if (!may_wait || !has_room || !has_turn(account, line, now)) {
    ++account.left_out;
    return nullptr;
  }
  ++account.waiting;
  ++waiting;
  return &account;
}

// One address gets half of the pace of all unauthenticated connections.
bool AuditBook::has_turn(Account& account, const Audit& line, TimePoint now) {
  if (account.rank != AuditRank::kStrangers) return account.pace.take(now);
  const std::string host = line.address.substr(0, line.address.rfind(':'));
  if (!strangers_.take(host, 1, now)) return false;
  if (account.pace.take(now)) return true;
  strangers_.give_back(host);
  return false;
}

void AuditBook::written(Account& account) {
  --account.waiting;
  --waiting_[account.rank];
}

std::vector<AuditBook::LeftOut> AuditBook::take_left_out(TimePoint now, bool all) {
  std::vector<LeftOut> list;
  for (auto it = accounts_.begin(); it != accounts_.end();) {
    auto& [key, account] = *it;
    if (account.left_out > 0 && (all || now >= account.told_at + kTellPeriod)) {
      list.push_back({key.second, key.first, std::exchange(account.left_out, 0)});
      account.told_at = now;
    }
    const bool over = account.waiting == 0 && account.left_out == 0 && account.pace.idle(now) &&
                      now >= account.told_at + kTellPeriod;
    it = over ? accounts_.erase(it) : std::next(it);
  }
  return list;
}

AuditBook::Account& AuditBook::account_of(const Audit& line) {
  const AuditRank rank = rank_of(line);
  Key key{rank, rank == AuditRank::kOwn || rank == AuditRank::kStrangers ? "" : line.identity};
  const auto known = accounts_.find(key);
  if (known != accounts_.end()) return known->second;
  if (accounts_.size() >= kAccountsMax) key.second.clear();
  return accounts_.try_emplace(std::move(key), Account{rank, traits_of(rank).pace}).first->second;
}

}  // namespace connect_bridge
