#include "core/policy/peer_accepts.hpp"

#include <utility>

#include "core/policy/policy.hpp"

namespace connect_bridge {
namespace {

// What a pattern costs beside its text.
constexpr std::uint64_t kPatternCost = 16;
// What each character of a name costs by a pattern with a star.
constexpr std::uint64_t kStarCost = 2;
// Interfaces that come and go: when there are more, all are compared again.
constexpr std::size_t kKnownMax = 65'536;
// What one of them takes beside its texts, which are there twice.
constexpr std::uint64_t kKnownBytes = 300;

// No name has a space in it.
std::string key_of(const Interface& what) {
  std::string key(what.kind == InterfaceKind::kTopic ? "t " : "s ");
  for (const auto part : {what.name, what.type, what.action_type, what.node})
    key.append(part).push_back(' ');
  return key;
}

}  // namespace

PeerAccepts::PeerAccepts(Accepts told, Budget* memory) : told_(std::move(told)), memory_(memory) {
  if (memory_) held_ = memory_->hold(0);
  count(told_.deny);
  for (const auto& rule : told_.rules)
    for (const auto* names :
         {&rule.topics, &rule.services, &rule.actions, &rule.parameters, &rule.types})
      count(*names);
}

void PeerAccepts::count(const std::vector<std::string>& patterns) {
  for (const auto& pattern : patterns) {
    text_cost_ += pattern.size() + kPatternCost;
    if (pattern.find('*') != std::string::npos) ++with_stars_;
  }
}

// The peer may have chosen the name as well: it is of a listener there.
std::uint64_t PeerAccepts::cost_of(const Interface& what) const {
  return text_cost_ + with_stars_ * kStarCost * (what.name.size() + what.node.size());
}

std::optional<bool> PeerAccepts::takes(const Interface& what) const {
  if (cost_of(what) <= kSmall) return accepted_by(told_, what);
  std::string key = key_of(what);
  if (const auto known = known_.find(key); known != known_.end()) return known->second;
  const std::uint64_t bytes = 2 * key.size() + kKnownBytes;
  // Answers are only remembered, so all may be forgotten at once: whoever asks again has them noted
  // again. Questions go too, since their entries do.
  if (known_.size() >= kKnownMax || (memory_ && memory_->room() < bytes)) {
    known_.clear();
    noted_.clear();
    held_.resize(0);
  }
  held_.resize(held_.amount() + bytes);
  known_.emplace(std::move(key), std::nullopt);
  noted_.push_back({what.kind, std::string(what.name), std::string(what.type),
                    std::string(what.action_type), std::string(what.node)});
  return std::nullopt;
}

std::uint64_t PeerAccepts::compare() {
  const Noted& next = noted_.front();
  const Interface what{next.kind, next.name, next.type, next.action_type, next.node};
  const std::uint64_t cost = cost_of(what);
  known_[key_of(what)] = accepted_by(told_, what);
  noted_.pop_front();
  return cost;
}

}  // namespace connect_bridge
