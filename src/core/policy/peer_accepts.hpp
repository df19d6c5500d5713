// The names that a peer would import, compiled.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/policy/enum_array.hpp"
#include "core/policy/interface.hpp"
#include "core/policy/pattern.hpp"
#include "core/wire/control.hpp"

namespace connect_bridge {

// Each interface is compared with it when it is asked about: whatever the list is, within the
// limits of docs/protocol.md ("accepts"), that costs no more than some microseconds and, with a
// list and a name that are made for it, some ten. Single-threaded.
class PeerAccepts {
 public:
  explicit PeerAccepts(Accepts list);
  PeerAccepts(const PeerAccepts&) = delete;
  PeerAccepts& operator=(const PeerAccepts&) = delete;

  [[nodiscard]] const Accepts& list() const { return list_; }

  // Whether the peer takes this channel (or origin of /parameter_events).
  [[nodiscard]] bool takes(const Interface& what) const;
  // Whether it takes the parameters of some nodes.
  [[nodiscard]] bool takes_parameters() const;

 private:
  using RuleSet = std::bitset<kAcceptRulesMax>;
  // Sorted by the name. Not hashed: the peer chooses the names.
  using Names = std::vector<std::pair<std::string_view, std::uint16_t>>;

  // The patterns of one kind: what is spelled out, and what has wildcards, each with its rule.
  struct Patterns {
    Names names;
    std::vector<std::string_view> wildcards;
    std::vector<std::uint16_t> rules_of_wildcards;
    std::optional<PatternSet> compiled;

    void add(const std::vector<std::string>& texts, std::size_t rule);
    void compile();
    // Whether one that belongs to one of `rules` matches.
    [[nodiscard]] bool match(std::string_view name, Hidden hidden, const RuleSet& rules) const;
  };

  [[nodiscard]] RuleSet rules_with_type(const Opening& opening) const;
  [[nodiscard]] bool denies(const Interface& what, const Opening& opening) const;

  const Accepts list_;  // all texts are pieces of it
  EnumArray<OpenedBy, Patterns, 5> opened_by_;
  Patterns deny_;
  Names types_;
  RuleSet of_any_type_;
};

}  // namespace connect_bridge
