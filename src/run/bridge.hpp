// The event loop of a side: the only place where the core, ROS, the network, login and workers
// meet.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <deque>
#include <memory>
#include <set>
#include <string>

#include "auth/authenticator.hpp"
#include "config/config.hpp"
#include "core/side/side.hpp"
#include "net/network.hpp"
#include "ros/gateway.hpp"
#include "ros/node/node.hpp"
#include "ros/parameters/parameter_server.hpp"
#include "run/workers.hpp"

namespace connect_bridge {

// What a bridge is built of; checked before anything is opened.
struct BridgeParts {
  Config config;
  SideOptions side;
  std::unique_ptr<Authenticator> authenticator;  // server
  DialOptions dial;                              // client
  ListenOptions listen;                          // server
  SocketOptions sockets;
};

// One input, then all its actions, then a packet for every connection that can take one, then wait
// (docs/architecture.md, "The loop"). Everything but the callbacks of the middleware and the
// workers, which only post, runs on the thread that calls run().
class Bridge {
 public:
  Bridge(ros::Node& node, BridgeParts parts);
  ~Bridge();

  // Opens the listener. Returns what is wrong (the port is in use, ...), empty if nothing.
  [[nodiscard]] std::string open();
  // Until SIGINT or SIGTERM; returns after an orderly end, at most a second later.
  void run();

 private:
  Now now() const;
  void feed(Input&& input);
  void settle();
  void carry_out(Action&& action);
  void authenticate(const Authenticate& request);
  void pump();
  void set_timer();
  void on_wake();
  void on_parameter_wake();
  void write_status();
  void give_memory_back();
  void every_second();
  void wait_for_signal();
  void stop();
  void end_if_closed();
  ros::SetResult set_parameters(const std::vector<Parameter>& parameters);
  [[nodiscard]] ros::ParameterServerOptions parameter_options();

  boost::asio::io_context io_{1};
  boost::asio::signal_set signals_;
  boost::asio::steady_timer timer_;      // the core's next deadline
  boost::asio::steady_timer second_;     // status, loop lag
  boost::asio::steady_timer last_call_;  // the end of an orderly stop
  ros::Node& node_;
  BridgeParts parts_;
  Config config_;
  Side side_;
  ros::Gateway gateway_;
  ros::ParameterServer parameters_;
  Network network_;
  std::unique_ptr<Workers> workers_;
  std::deque<Input> inputs_;
  std::set<ConnectionId> connections_;
  bool settling_ = false;
  bool stopping_ = false;
  std::optional<TimePoint> timer_at_;
  TimePoint second_due_{};
  double loop_lag_ms_ = 0;
  std::uint64_t moved_ = 0;  // messages, at the last second
  unsigned quiet_seconds_ = 0;
  std::string status_problem_;
};

}  // namespace connect_bridge
