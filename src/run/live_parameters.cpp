#include "run/live_parameters.hpp"

#include <boost/asio/post.hpp>
#include <string>
#include <utility>

#include "config/describe.hpp"

namespace connect_bridge {

LiveParameters::LiveParameters(boost::asio::io_context& io, ros::Node& node, Config config,
                               Changes changes)
    : io_(io),
      node_(node),
      config_(std::move(config)),
      changes_(std::move(changes)),
      server_(node, server_options()) {}

ros::ParameterServerOptions LiveParameters::server_options() {
  ros::ParameterServerOptions options;
  options.entries = describe_parameters(config_);
  options.set = [this](const std::vector<Parameter>& p) { return set(p); };
  options.describe = [this](const std::string& name) {
    return describe_parameter(name, config_.role);
  };
  options.use_sim_time = changes_.use_sim_time;
  options.wake = [this] { boost::asio::post(io_, [this] { answer(); }); };
  return options;
}

void LiveParameters::answer() {
  if (server_.drain()) boost::asio::post(io_, [this] { answer(); });
}

ros::SetResult LiveParameters::set(const std::vector<Parameter>& parameters) {
  Parsed parsed = apply_change(config_, parameters, {});
  if (parsed.config) {
    for (const auto& warning : parsed.config->warnings) node_.log(LogLevel::kWarn, warning);
    config_ = std::move(*parsed.config);
    changes_.policy(config_.policy);
    return {};
  }
  std::string reason;
  for (const auto& problem : parsed.problems)
    reason += (reason.empty() ? "" : "; ") + to_text(problem);
  return {false, reason};
}

}  // namespace connect_bridge
