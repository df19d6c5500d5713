// Which endpoints and nodes of the graph this process made, so that it never bridges its own
// traffic.
#pragma once

#include <cstddef>
#include <deque>
#include <mutex>
#include <set>
#include <string>
#include <unordered_set>

#include "core/base/ids.hpp"

namespace connect_bridge::ros {

// Any thread.
class OwnEndpoints {
 public:
  // prefix_size: see distro::participant_prefix_size().
  explicit OwnEndpoints(std::size_t prefix_size) : prefix_size_(prefix_size) {}

  void add(const Gid& gid);
  [[nodiscard]] bool contains(const Gid& gid) const;
  void add_node(const std::string& full_name);
  void remove_node(const std::string& full_name);
  [[nodiscard]] bool contains_node(const std::string& full_name) const;

 private:
  // Samples of a mirror arrive after it is gone, so ids stay known for a while.
  static constexpr std::size_t kIdsMax = 4096;

  const std::size_t prefix_size_;
  mutable std::mutex mutex_;
  bool prefix_known_ = false;
  Gid prefix_;
  std::unordered_set<Gid> ids_;
  std::deque<Gid> order_;
  std::set<std::string, std::less<>> nodes_;
};

}  // namespace connect_bridge::ros
