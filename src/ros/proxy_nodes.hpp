// Nodes that stand for nodes of the other side, each as long as something belongs to it.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "ros/node.hpp"

namespace connect_bridge::ros {

// A proxy is a name in the graph: it publishes no log, has no parameters and heeds no argument of
// this process. Thread: the loop's. Destroy it after all handles and before the Node.
class ProxyNodes {
 public:
  // Keeps the node alive; its last owner removes it from the graph.
  using Handle = std::shared_ptr<rcl_node_s>;

  explicit ProxyNodes(Node& node) : node_(node) {}
  ProxyNodes(const ProxyNodes&) = delete;
  ProxyNodes& operator=(const ProxyNodes&) = delete;

  // The proxy of this name ("/fleet/talker"), made if it is not there. An empty name, and with a
  // warning one that ROS refuses: our own node.
  Handle get(const std::string& name);

  [[nodiscard]] std::size_t size() const { return nodes_.size(); }

 private:
  Handle make(const std::string& name);
  Handle own() const;

  Node& node_;
  std::map<std::string, std::weak_ptr<rcl_node_s>, std::less<>> nodes_;
};

}  // namespace connect_bridge::ros
