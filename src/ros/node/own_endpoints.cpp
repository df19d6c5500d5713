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
  ids_.insert(gid);
}

void OwnEndpoints::remove(const Gid& gid) {
  const std::lock_guard lock(mutex_);
  if (ids_.erase(gid) == 0 || !ended_.insert(gid).second) return;
  ended_order_.push_back(gid);
  if (ended_order_.size() > kEndedMax) {
    ended_.erase(ended_order_.front());
    ended_order_.pop_front();
  }
}

bool OwnEndpoints::is_known(const Gid& gid) const {
  const std::lock_guard lock(mutex_);
  if (shown_.contains(gid)) return false;
  if (prefix_size_ == 0) return ids_.contains(gid) || ended_.contains(gid);
  return prefix_known_ &&
         std::equal(gid.bytes.begin(), gid.bytes.begin() + prefix_size_, prefix_.bytes.begin());
}

bool OwnEndpoints::contains(const Gid& gid) const {
  if (is_known(gid)) return true;
  if (prefix_size_ > 0) return false;
  const std::lock_guard made(making_);
  return is_known(gid);
}

void OwnEndpoints::show(const Gid& gid) {
  const std::lock_guard lock(mutex_);
  shown_.insert(gid);
}

bool OwnEndpoints::shows(const Gid& gid) const {
  const std::lock_guard lock(mutex_);
  return shown_.contains(gid);
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

void OwnEndpoints::announce_server(const std::string& service) {
  const std::lock_guard lock(mutex_);
  ++servers_[service];
}

void OwnEndpoints::remove_server(const std::string& service) {
  const std::lock_guard lock(mutex_);
  const auto found = servers_.find(service);
  if (found != servers_.end() && --found->second == 0) servers_.erase(found);
}

std::map<std::string, std::size_t> OwnEndpoints::servers() const {
  const std::lock_guard lock(mutex_);
  return servers_;
}

}  // namespace connect_bridge::ros
