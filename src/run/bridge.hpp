// A side: where the core, ROS, the network, login and workers meet.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "access/login/authenticator.hpp"
#include "access/login/credential.hpp"
#include "access/pairing/pairing.hpp"
#include "config/config.hpp"
#include "core/base/log_limit.hpp"
#include "core/side/side.hpp"
#include "net/websocket/network.hpp"
#include "ops/audit/audit_log.hpp"
#include "ops/status/status_file.hpp"
#include "ops/status/status_site.hpp"
#include "ros/gateway.hpp"
#include "run/heap.hpp"
#include "run/live_parameters.hpp"
#include "run/login_desk.hpp"
#include "run/loop.hpp"
#include "run/loop_guard.hpp"
#include "run/parts.hpp"
#include "run/signals.hpp"
#include "run/supervisor.hpp"
#include "run/workers.hpp"

namespace connect_bridge {

// Everything but the callbacks of the middleware, the workers and the login desk, which only post,
// runs on the thread that calls run().
class Bridge {
 public:
  Bridge(ros::Node& node, BridgeParts parts);

  // Opens the listener. Returns what is wrong (the port is in use, ...), empty if nothing.
  [[nodiscard]] std::string open();
  // Until SIGINT or SIGTERM, or until the server refuses the invitation that this client was
  // started with, or another server answers; returns after an orderly end, at most a second later.
  void run();
  // Server: where it listens, once it is open.
  [[nodiscard]] std::uint16_t port() const { return network_.listen_port(); }
  // After run(): that of the program, kExitConfiguration where the invitation cannot be
  // used.
  [[nodiscard]] int exit_code() const { return exit_code_; }

 private:
  [[nodiscard]] std::string open_audit_log();
  [[nodiscard]] std::string listen();
  void apply(const Config& now);
  void note(AuditEvent event, std::string reason = {});
  // From threads of others: done by the loop's.
  void log_later(LogLevel level, std::string text);
  void feed_later(Input&& input);
  // Whether that was in the middleware.
  bool carry_out(Action&& action);
  void send_request(SendRequest&& request);
  void open_gate(const OpenGate& gate);
  void on_network(Input&& input);
  // Whether this client ends because of that: it was started with an invitation, which cannot be
  // used. Empty: no problem.
  [[nodiscard]] bool ends_by(const std::string& problem);
  void close_connection(const CloseConnection& end);
  void authenticate(Authenticate&& request);
  void judge_certificate(const Authenticate& request);
  void send();
  void on_wake();
  // Calls every_second(), and again in a second. The timer waits in the same queue as everything
  // else, so its delay is the loop's.
  void tick();
  void every_second(double lag_ms);
  [[nodiscard]] RunStatus run_status(double lag_ms, bool running);
  // The status is taken now, link by link in turns, and then written.
  void take_status(double lag_ms);
  void take_status_of_next();
  void publish_diagnostics(const StatusPicture& picture);
  void stop();

  boost::asio::io_context io_{1};
  ros::Node& node_;
  BridgeParts parts_;
  const std::chrono::system_clock::time_point started_ = std::chrono::system_clock::now();
  int exit_code_ = 0;
  Side side_;
  Loop loop_;
  ros::Gateway gateway_;
  LiveParameters parameters_;
  Network network_;
  std::optional<AuditLog> audit_log_;
  StatusFile status_file_;
  // The status picture that is being taken, link by link. `left`: the links that are still missing;
  // the last one is next.
  struct Taking {
    std::shared_ptr<StatusPicture> picture;
    std::vector<LinkId> left;
  };
  std::optional<Taking> taking_;
  LinkPlaces link_places_;
  HeapTrim heap_;
  Supervisor supervisor_;
  LogLimit lags_;
  boost::asio::steady_timer seconds_;
  std::chrono::steady_clock::time_point tick_due_{};
  Stop stop_;
  Hangup hangup_;
  Workers workers_;
  LoginDesk login_desk_;    // its threads end before what they use
  StatusSite status_site_;  // the same
  LoopGuard guard_;         // last: it watches no destructor, LastSteps does
};

}  // namespace connect_bridge
