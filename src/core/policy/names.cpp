#include "core/policy/names.hpp"

#include <algorithm>
#include <utility>

#include "core/policy/interface.hpp"
#include "core/policy/pattern.hpp"

namespace connect_bridge {
NameMap::NameMap(std::string prefix, std::vector<Pair> remap)
    : prefix_(std::move(prefix)), remap_(std::move(remap)) {
  while (!prefix_.empty() && prefix_.back() == '/') prefix_.pop_back();
  if (!prefix_.empty() && prefix_.front() != '/') prefix_.insert(prefix_.begin(), '/');
}

namespace {

// The parts of an action are renamed like the action.
std::size_t action_suffix(std::string_view name) {
  const auto at = name.rfind("/_action/");
  return at == 0 ? std::string_view::npos : at;
}

// The one topic on which all nodes of a graph tell of their parameters, and look for those of
// others. Its messages name the node.
bool is_of_all_nodes(std::string_view name) {
  return name == kParameterEvents;
}

}  // namespace

std::string NameMap::to_local(std::string_view wire) const {
  if (const auto at = action_suffix(wire); at != std::string_view::npos)
    return to_local(wire.substr(0, at)) + std::string(wire.substr(at));
  // A remapped name is exact and takes no prefix.
  for (const auto& pair : remap_) {
    if (pair.wire == wire) return pair.local;
  }
  return is_of_all_nodes(wire) ? std::string(wire) : prefix_ + std::string(wire);
}

std::optional<std::string> NameMap::to_wire(std::string_view local) const {
  if (const auto at = action_suffix(local); at != std::string_view::npos) {
    auto action = to_wire(local.substr(0, at));
    if (action) *action += local.substr(at);
    return action;
  }
  // Before the map: not even `remap` lets a peer reach what bridges tell each other.
  if (is_of_bridges(local)) return std::nullopt;
  for (const auto& pair : remap_) {
    if (pair.local == local) return pair.wire;
  }
  const bool is_moved = std::any_of(remap_.begin(), remap_.end(),
                                    [&](const Pair& pair) { return pair.wire == local; });
  if (is_of_all_nodes(local) && !is_moved) return std::string(local);
  if (local.substr(0, prefix_.size()) != prefix_) return std::nullopt;
  const auto wire = local.substr(prefix_.size());
  // Below the prefix, and not only beginning like it: /robot10/tf is nothing of /robot1.
  if (wire.size() < 2 || wire.front() != '/' || (is_of_all_nodes(wire) && !prefix_.empty()))
    return std::nullopt;
  // A name that remap moved does not also exist at its old place.
  for (const auto& pair : remap_) {
    if (pair.wire == wire) return std::nullopt;
  }
  return std::string(wire);
}

bool is_prefix_word(std::string_view word) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  return !word.empty() && is_letter(word.front()) && word.find('/') == std::string_view::npos &&
         is_canonical_name("/" + std::string(word));
}

std::string prefix_word_of(std::string_view name) {
  std::string word;
  for (const char c : name.substr(0, 40)) {
    const bool fits = is_prefix_word(std::string{'a', c});
    if (fits || (!word.empty() && word.back() != '_')) word += fits ? c : '_';
  }
  return is_prefix_word(word) ? word : "robot" + word;
}

Result<NameMap> PeerNames::of(const std::string& identity) const {
  if (!words_) return all_;
  const auto refused = [](std::string why) {
    return Error{CloseCode::kLoginRefused, "prefix is by_identity, and " + std::move(why)};
  };
  if (const auto own = words_->find(identity); own != words_->end())
    return NameMap("/" + own->second, remap_);
  if (!is_prefix_word(identity))
    return refused("\"" + identity + "\" is not a valid ROS name: identity_names: [\"" + identity +
                   ":=" + prefix_word_of(identity) + "\"] gives it one");
  const auto taken = std::find_if(words_->begin(), words_->end(),
                                  [&](const auto& other) { return other.second == identity; });
  if (taken != words_->end())
    return refused("identity_names has given the name \"" + identity + "\" to \"" + taken->first +
                   "\": give one of them another name there");
  return NameMap("/" + identity, remap_);
}

}  // namespace connect_bridge
