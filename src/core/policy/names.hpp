// Names at this side against names on the wire.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.hpp"

namespace connect_bridge {

// The names of one peer: `prefix` ("/robot1" or empty) is put before every wire name, unless an
// exact `remap` pair (wire name, local name) wins. Both directions use the same map.
class NameMap {
 public:
  struct Pair {
    std::string wire;
    std::string local;
  };
  NameMap() = default;
  NameMap(std::string prefix, std::vector<Pair> remap);
  [[nodiscard]] std::string to_local(std::string_view wire) const;
  // nullopt: this local name is not visible to the peer (outside the prefix, remapped away, or the
  // bridges' own).
  [[nodiscard]] std::optional<std::string> to_wire(std::string_view local) const;
  // Before the local names of the peer; empty: they are the same as on the wire.
  [[nodiscard]] const std::string& prefix() const { return prefix_; }
  // A name on the wire; of what has none, because it is outside the prefix, its own.
  [[nodiscard]] std::string wire_name(const std::string& local) const {
    return to_wire(local).value_or(local);
  }

 private:
  std::string prefix_;
  std::vector<Pair> remap_;
};

// The map of each link, by the identity of its peer: the same for all, or each identity's
// interfaces below its own name. Immutable.
class PeerNames {
 public:
  using Words = std::map<std::string, std::string>;  // by identity

  PeerNames() = default;                            // all names stay
  PeerNames(NameMap all) : all_(std::move(all)) {}  // NOLINT: implicit
  // Identities in `words` are below their word, all others below their own name. A word is a single
  // token of a ROS name (is_prefix_word), and no two identities have the same.
  PeerNames(Words words, std::vector<NameMap::Pair> remap)
      : words_(std::move(words)), remap_(std::move(remap)) {}

  // An error (login refused): the identity's name cannot stand before names, or another identity
  // has it. It says how to cure that.
  [[nodiscard]] Result<NameMap> of(const std::string& identity) const;

 private:
  NameMap all_;
  std::optional<Words> words_;  // none: `all_`
  std::vector<NameMap::Pair> remap_;
};

// A token that an identity's names may be below: letters, digits and '_', a letter first.
[[nodiscard]] bool is_prefix_word(std::string_view word);
// One that is like this name; of several names it may be the same.
[[nodiscard]] std::string prefix_word_of(std::string_view name);

}  // namespace connect_bridge
