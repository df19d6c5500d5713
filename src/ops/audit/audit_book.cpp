#include "ops/audit/audit_book.hpp"

#include <array>
#include <boost/asio/ip/address.hpp>
#include <iterator>
#include <utility>

#include "net/tcp/proxy_header.hpp"

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
      {"strangers", {50, milliseconds(4000)}},  // unauthenticated connections, all together
  }};
  return kTraits.at(static_cast<std::size_t>(rank));
}

// Whoever has an address of IPv4, or a network of IPv6, has as many ports and addresses in it.
std::string network_in(const std::string& address) {
  std::string host = address.substr(0, address.rfind(':'));
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  boost::system::error_code none;
  const auto known = boost::asio::ip::make_address(host, none);
  constexpr int kSiteBytes = 6;  // a /48, which one customer may have
  return none ? host : network_of(plain_address(known), kSiteBytes);
}

}  // namespace

AuditRank rank_of(const Audit& line) {
  switch (line.event) {
    case AuditEvent::kStarted:
    case AuditEvent::kStopped:
    case AuditEvent::kRulesChanged:
    case AuditEvent::kRulesRefused: return AuditRank::kOwn;
    case AuditEvent::kCall:
    case AuditEvent::kGoal:
    case AuditEvent::kGoalCancelled:
    case AuditEvent::kWheelTaken:
    case AuditEvent::kHalted:
    case AuditEvent::kWheelLeft: return AuditRank::kCalls;
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
    if (account.rank != AuditRank::kStrangers) return nullptr;
    const std::string network = network_in(line.address);
    const bool has_place = left_out_of_.size() < kNetworksShown || left_out_of_.contains(network);
    ++left_out_of_[has_place ? network : "others"];
    return nullptr;
  }
  ++account.waiting;
  ++waiting;
  return &account;
}

bool AuditBook::has_turn(Account& account, const Audit& line, TimePoint now) {
  if (account.rank != AuditRank::kStrangers) return account.pace.take(now);
  return has_stranger_turn(account, network_in(line.address), now);
}

// Noisy networks use up the pace of all, and leave the first lines of the others alone.
bool AuditBook::has_stranger_turn(Account& account, const std::string& network, TimePoint now) {
  forget_networks(now);
  auto known = networks_.find(network);
  if (known == networks_.end() && networks_.size() < kNetworksMax)
    known = networks_.try_emplace(network).first;
  const bool is_new = known != networks_.end() && known->second.lines < kFirstLines;
  if (!strangers_.take(network, 1, now)) return false;
  if (!(is_new && first_lines_.take(now)) && !account.pace.take(now)) {
    strangers_.give_back(network);
    return false;
  }
  if (known != networks_.end()) known->second = {known->second.lines + 1, now};
  return true;
}

void AuditBook::forget_networks(TimePoint now) {
  if (now < forgot_at_ + kTellPeriod) return;
  forgot_at_ = now;
  std::erase_if(networks_, [&](const auto& entry) {
    return entry.second.lines == 0 || now >= entry.second.last + kLately;
  });
}

void AuditBook::written(Account& account) {
  --account.waiting;
  --waiting_[account.rank];
}

std::vector<AuditBook::LeftOut> AuditBook::take_left_out(TimePoint now, bool all) {
  std::vector<LeftOut> list;
  for (auto it = accounts_.begin(); it != accounts_.end();) {
    auto& [key, account] = *it;
    if (account.left_out > 0 && (all || now >= account.logged_at + kTellPeriod)) {
      const bool strangers = key.first == AuditRank::kStrangers;
      list.push_back({key.second, key.first, std::exchange(account.left_out, 0),
                      strangers ? std::exchange(left_out_of_, {}) : decltype(left_out_of_){}});
      account.logged_at = now;
    }
    const bool over = account.waiting == 0 && account.left_out == 0 && account.pace.idle(now) &&
                      now >= account.logged_at + kTellPeriod;
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
