// A side of the bridge: connects the core, ROS, the network, login and workers.
// One unit: the layers meet here, and nowhere else.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
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
#include "ops/status/lately.hpp"
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
#include "run/unread_files.hpp"
#include "run/workers.hpp"

namespace connect_bridge {

// Everything runs on the thread that calls run(), except callbacks of the middleware, the workers
// and the login desk; these only post.
class Bridge {
 public:
  Bridge(ros::Node& node, BridgeParts parts);

  // Opens the listener. Returns the problem (the port is in use, ...); empty: none.
  [[nodiscard]] std::string open();
  // Runs until SIGINT or SIGTERM; a client with an invitation also until the server refuses it, or
  // another server answers. Returns after an orderly stop, at most a second later.
  void run();
  // Server: the port of the listener, once it is open.
  [[nodiscard]] std::uint16_t port() const { return network_.listen_port(); }
  // The exit code of the program, after run(); kExitConfiguration if the invitation cannot be used.
  [[nodiscard]] int exit_code() const { return exit_code_; }

 private:
  [[nodiscard]] std::string open_audit_log();
  [[nodiscard]] std::string listen();
  void apply(const Config& now);
  void note(AuditEvent event, std::string reason = {});
  // Functions for other threads: the loop's thread logs or feeds later.
  void log_later(LogLevel level, std::string text);
  void feed_later(Input&& input);
  // The result of a job, from a worker's thread.
  void feed_result(Workers& of, JobDone done);
  // True if the action was one for the middleware.
  bool carry_out(Action&& action);
  void send_request(SendRequest&& request);
  void open_gate(const OpenGate& gate);
  void on_network(Input&& input);
  // Stops this client because its invitation cannot be used. False, and nothing happens, if
  // `problem` is empty.
  [[nodiscard]] bool ends_by(const std::string& problem);
  void close_connection(const CloseConnection& end);
  void authenticate(Authenticate&& request);
  void judge_certificate(const Authenticate& request);
  void send();
  void on_wake();
  // Calls every_second(), and again after a second. The timer waits in the same queue as all other
  // work, so its delay is the loop's.
  void tick();
  void every_second(double lag_ms);
  [[nodiscard]] RunStatus run_status(double lag_ms, bool running);
  // Takes the status, link by link in turns, and then writes it.
  void take_status(double lag_ms);
  void take_status_of_next();
  void publish_diagnostics(const StatusPicture& picture);
  // Peers are told what concerns them.
  void diagnose(std::shared_ptr<const StatusPicture> picture);
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
  // The status picture that is being taken. `left`: links that are still missing; the last one is
  // next.
  struct Taking {
    std::shared_ptr<StatusPicture> picture;
    std::vector<LinkId> left;
    bool is_diagnosed;
  };
  std::optional<Taking> taking_;
  LinkPlaces link_places_;
  Lately lately_;
  HeapTrim heap_;
  UnreadFiles unread_files_;  // of logins by certificate; the desk has its own
  Supervisor supervisor_;
  LogLimit lags_;
  boost::asio::steady_timer seconds_;
  std::chrono::steady_clock::time_point tick_due_{};
  Stop stop_;
  Hangup hangup_;
  Workers workers_;
  Workers picture_workers_;
  TimePoint diagnosed_at_{};
  bool diagnosing_ = false;
  boost::asio::thread_pool diagnosis_{1};
  LoginDesk login_desk_;    // its threads end before the members that they use
  StatusSite status_site_;  // the same
  LoopGuard guard_;         // last: it does not watch the destructors, LastSteps does
};

}  // namespace connect_bridge
