#include "core/graph/claims.hpp"

#include <algorithm>
#include <utility>

namespace connect_bridge {
namespace {

constexpr std::size_t kBridgesMax = 256;

}  // namespace

Gid service_gid(std::string_view service) {
  Gid result;
  for (std::size_t word = 0; word < 3; ++word) {
    std::uint64_t hash = 14695981039346656037ULL + word;  // FNV-1a
    const auto add = [&](std::string_view text) {
      for (const char c : text) hash = (hash ^ static_cast<std::uint8_t>(c)) * 1099511628211ULL;
    };
    add("service:");
    add(service);
    for (std::size_t i = 0; i < 8; ++i)
      result.bytes[8 * word + i] = static_cast<std::uint8_t>(hash >> (8 * i));
  }
  return result;
}

bool Claims::update(const Gid& publisher, Claim claim) {
  if (claim.side == own_) return false;
  if (by_publisher_.size() >= kBridgesMax && !by_publisher_.contains(publisher)) return false;
  by_publisher_[publisher] = std::move(claim);
  rebuild();
  return true;
}

bool Claims::retain(const std::unordered_set<Gid>& before, const std::unordered_set<Gid>& now) {
  const auto gone = std::erase_if(by_publisher_, [&](const auto& entry) {
    return before.contains(entry.first) && !now.contains(entry.first);
  });
  if (gone > 0) rebuild();
  return gone > 0;
}

bool Claims::is_here(const Token128& side) const {
  return std::any_of(by_publisher_.begin(), by_publisher_.end(),
                     [&](const auto& entry) { return entry.second.side == side; });
}

bool Claims::taken(const Gid& origin, bool feeds) const {
  const auto it = claimed_.find(origin);
  if (it == claimed_.end()) return false;
  const Others& others = it->second;
  if (feeds) return others.smaller_feeding;
  return others.feeding || others.smaller;
}

void Claims::rebuild() {
  claimed_.clear();
  for (const auto& [publisher, claim] : by_publisher_) {
    const bool smaller = claim.side < own_;
    for (const auto& [gid, feeds] : claim.origins) {
      Others& others = claimed_[gid];
      others.feeding |= feeds;
      others.smaller |= smaller;
      others.smaller_feeding |= smaller && feeds;
    }
  }
}

}  // namespace connect_bridge
