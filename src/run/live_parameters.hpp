// The configuration in use, and the parameters of the node that show and change it.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <vector>

#include "config/config.hpp"
#include "ros/node/node.hpp"
#include "ros/parameters/parameter_server.hpp"

namespace connect_bridge {

// Thread: that of the io_context.
class LiveParameters {
 public:
  struct Changes {
    std::function<void(const Policy&)> policy;
    std::function<void(bool on)> use_sim_time;
  };

  LiveParameters(boost::asio::io_context& io, ros::Node& node, Config config, Changes changes);

  [[nodiscard]] const Config& config() const { return config_; }

 private:
  [[nodiscard]] ros::ParameterServerOptions server_options();
  ros::SetResult set(const std::vector<Parameter>& parameters);
  void answer();

  boost::asio::io_context& io_;
  ros::Node& node_;
  Config config_;
  const Changes changes_;
  ros::ParameterServer server_;
};

}  // namespace connect_bridge
