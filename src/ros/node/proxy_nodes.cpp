#include "ros/node/proxy_nodes.hpp"

#include <rcl/arguments.h>
#include <rcl/node.h>
#include <rcl/node_options.h>

#include "ros/node/own_endpoints.hpp"
#include "ros/rcl/rcl_result.hpp"

namespace connect_bridge::ros {

ProxyNodes::Handle ProxyNodes::own() const {
  return {std::shared_ptr<void>{}, node_.handle()};
}

ProxyNodes::Handle ProxyNodes::get(const std::string& name) {
  if (name.empty() || name == node_.facts().full_name) return own();
  if (const auto found = nodes_.find(name); found != nodes_.end()) return found->second.lock();
  auto made = make(name);
  if (!made) return own();
  nodes_.emplace(name, made);
  return made;
}

ProxyNodes::Handle ProxyNodes::make(const std::string& name) {
  const auto slash = name.rfind('/');
  if (slash == std::string::npos) {
    refused("\"" + name + "\" is not the name of a node");
    return nullptr;
  }
  if (is_taken_(name)) {
    refused("a remote node has the same name as a node of this graph, " + name);
    return nullptr;
  }
  const std::string name_space = slash == 0 ? "/" : name.substr(0, slash);
  const std::string base = name.substr(slash + 1);
  rcl_node_options_t options = rcl_node_get_default_options();
  options.use_global_arguments = false;
  options.enable_rosout = false;
  // A node without the process's arguments needs its own, even if they are empty.
  rcl_ret_t result =
      rcl_parse_arguments(0, nullptr, rcl_get_default_allocator(), &options.arguments);
  auto made = std::make_unique<rcl_node_t>(rcl_get_zero_initialized_node());
  // The announcement comes first: the watcher's thread may see the node in the graph before
  // rcl_node_init() returns.
  node_.own().announce_node(name);
  if (result == RCL_RET_OK) {
    result = rcl_node_init(made.get(), base.c_str(), name_space.c_str(), node_.context(), &options);
  }
  if (result != RCL_RET_OK) {
    refused(error_text("cannot create the node " + name, result));
    ignore_error(rcl_node_options_fini(&options));
    node_.own().remove_node(name);
    return nullptr;
  }
  ignore_error(rcl_node_options_fini(&options));
  node_.own().settle_node(name);
  return {made.release(), [this, name](rcl_node_t* node) {
            node_.own().announce_node(name);
            ignore_error(rcl_node_fini(node));
            delete node;
            node_.own().remove_node(name);
            nodes_.erase(name);
          }};
}

void ProxyNodes::refused(const std::string& why) {
  node_.log(refusals_, LogLevel::kWarn,
            why + "; its topics and services are shown under " + node_.facts().full_name);
}

}  // namespace connect_bridge::ros
