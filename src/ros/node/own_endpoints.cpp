#include "ros/node/own_endpoints.hpp"

#include <algorithm>

namespace connect_bridge::ros {

void OwnEndpoints::add(const Gid& gid) {
  const std::lock_guard lock(mutex_);
  if (prefix_size_ > 0) {
    if (prefix_known_) return;
    prefix_ = gid;
    prefix_known_ = true;
    return;
  }
  if (!ids_.insert(gid).second) return;
  order_.push_back(gid);
  if (order_.size() > kIdsMax) {
    ids_.erase(order_.front());
    order_.pop_front();
  }
}

bool OwnEndpoints::contains(const Gid& gid) const {
  const std::lock_guard lock(mutex_);
  if (prefix_size_ == 0) return ids_.count(gid) != 0;
  return prefix_known_ &&
         std::equal(gid.bytes.begin(), gid.bytes.begin() + prefix_size_, prefix_.bytes.begin());
}

void OwnEndpoints::announce_node(const std::string& full_name) {
  const std::lock_guard lock(mutex_);
  nodes_[full_name] = kUnsettled;
}

void OwnEndpoints::settle_node(const std::string& full_name) {
  const std::lock_guard lock(mutex_);
  nodes_[full_name] = ++last_settled_;
}

void OwnEndpoints::remove_node(const std::string& full_name) {
  const std::lock_guard lock(mutex_);
  nodes_.erase(full_name);
}

std::map<std::string, std::uint64_t> OwnEndpoints::nodes() const {
  const std::lock_guard lock(mutex_);
  return nodes_;
}

}  // namespace connect_bridge::ros
