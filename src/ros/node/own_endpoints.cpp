#include "ros/node/own_endpoints.hpp"

#include <rcl/publisher.h>
#include <rmw/error_handling.h>
#include <rmw/rmw.h>

#include <algorithm>

#include "ros/rcl/distro.hpp"

namespace connect_bridge::ros {

void OwnEndpoints::add(const rcl_publisher_t& publisher) {
  const rmw_publisher_t* handle = rcl_publisher_get_rmw_handle(&publisher);
  rmw_gid_t gid{};
  if (handle != nullptr && rmw_get_gid_for_publisher(handle, &gid) == RMW_RET_OK) {
    add(distro::gid_of(gid.data));
  } else {
    rmw_reset_error();
  }
}

void OwnEndpoints::add(const Gid& gid) {
  const std::lock_guard lock(mutex_);
  if (prefix_size_ > 0) {
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
