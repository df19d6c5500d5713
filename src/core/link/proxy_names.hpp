// Names of nodes that stand here for those of peers.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>

namespace connect_bridge {

// The names that one identity uses at present. Each is a node in this graph, which every process of
// the graph pays for, so their number has a limit. Single-threaded.
class ProxyNames {
  using Names = std::map<std::string, std::weak_ptr<const std::string>>;

 public:
  // A large robot has some hundred nodes.
  static constexpr std::size_t kMost = 512;

  // The name is in use as long as one of its holds exists. A hold may outlive this object.
  using Hold = std::shared_ptr<const std::string>;

  // Null: too many other names are in use.
  [[nodiscard]] Hold take(const std::string& name) {
    if (const auto found = names_->find(name); found != names_->end()) return found->second.lock();
    if (names_->size() >= kMost) return nullptr;
    Hold hold(new std::string(name), [names = names_](const std::string* own) {
      names->erase(*own);
      delete own;
    });
    names_->emplace(name, hold);
    return hold;
  }

 private:
  std::shared_ptr<Names> names_ = std::make_shared<Names>();
};

}  // namespace connect_bridge
