// Nodes that represent nodes of the peer; each exists as long as an entity belongs to it.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "ros/node/node.hpp"

namespace connect_bridge::ros {

// A proxy is only a name in the graph: it has no log and no parameters, and ignores the arguments
// of this process. Destroy this object after all handles and before the Node. Thread: the loop's.
class ProxyNodes {
 public:
  // Keeps the node alive; its last owner removes it from the graph.
  using Handle = std::shared_ptr<rcl_node_s>;

  // `is_taken`: true if a node of another process has this name.
  ProxyNodes(Node& node, std::function<bool(const std::string& name)> is_taken)
      : node_(node), is_taken_(std::move(is_taken)) {}
  ProxyNodes(const ProxyNodes&) = delete;
  ProxyNodes& operator=(const ProxyNodes&) = delete;

  // The proxy of this name ("/fleet/talker"), created if needed. Our own node if the name is empty;
  // also, with a warning, if ROS refuses the name or a node of this graph has it. The peer chooses
  // names and must not impersonate a node here.
  Handle get(const std::string& name);

  [[nodiscard]] std::size_t size() const { return nodes_.size(); }

 private:
  Handle make(const std::string& name);
  Handle own() const;
  // Logs the reason why our own node is used in place of a proxy.
  void refused(const std::string& why);

  Node& node_;
  const std::function<bool(const std::string& name)> is_taken_;
  LogLimit refusals_;
  std::map<std::string, std::weak_ptr<rcl_node_s>, std::less<>> nodes_;
};

}  // namespace connect_bridge::ros
