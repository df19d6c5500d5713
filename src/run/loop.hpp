// The loop of a side: docs/architecture.md, "The loop".
#pragma once

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <deque>
#include <functional>
#include <optional>
#include <utility>

#include "core/side/side.hpp"
#include "ros/node/node.hpp"
#include "run/step_cost.hpp"

namespace connect_bridge {

// Everything that reaches the core goes through step(). Thread: that of the io_context.
class Loop {
 public:
  struct Ports {
    std::function<bool(Action&&)> carry_out;  // whether that was in the middleware
    std::function<void(ConnectionId)> read;   // the packet that has come there is to be fed
    std::function<void()> send;               // what connections have to send (Side::take_ready)
  };

  Loop(boost::asio::io_context& io, const ros::Node& node, Side& side, Ports ports)
      : io_(io), node_(node), side_(side), ports_(std::move(ports)), timer_(io) {}

  // The longest step since this was last asked.
  [[nodiscard]] Duration take_longest() { return std::exchange(longest_, Duration::zero()); }
  // The time of an input that arrives now.
  [[nodiscard]] Now now() const;

  // One step with one input. An input from inside an action (a login answered at once) waits until
  // this step has handled the earlier inputs.
  void feed(Input&& input);

  // A packet has come there: it is read when it is its turn (Side::take_turn). Between two of them
  // the sockets are looked at, so that who has used less comes first.
  void arrived(ConnectionId connection);

  // The next packet of a connection that can take one; nullopt: none now. What is held back because
  // of the link's rate is pulled again when its time has come.
  std::optional<Packet> next_packet(ConnectionId connection, const Repairs& repairs);

  // One step with all the inputs that `source` gives to the function that it gets, so that messages
  // that were ready together are packed together. Returns what `source` returns.
  template <class Source>
  auto step(Source&& source) {
    begin_step();
    const auto result = source([this](Input&& input) { handle(std::move(input)); });
    end_step();
    return result;
  }

 private:
  void begin_step();
  void handle(Input&& input);
  void end_step();
  void set_timer();
  void wait_until(TimePoint when);
  void plan_turn();
  // At the sockets, so many times, before the next packet has its turn.
  void look(int times);

  boost::asio::io_context& io_;
  const ros::Node& node_;
  Side& side_;
  const Ports ports_;
  boost::asio::steady_timer timer_;  // the core's next deadline
  std::optional<TimePoint> timer_at_;
  TimePoint reads_until_{};  // sockets are read first, before the timer does its work
  std::deque<Input> waiting_;
  std::chrono::steady_clock::time_point began_{};  // the step
  bool stepping_ = false;
  bool handled_ = false;  // an input, in this step
  bool sending_ = false;  // as the end of a step, which sets the timer itself
  bool turn_planned_ = false;
  StepCost cost_;
  Duration step_took_{};  // the last one
  Duration longest_{};
};

}  // namespace connect_bridge
