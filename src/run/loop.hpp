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
#include "run/step_cost.hpp"

namespace connect_bridge {

// All inputs of the core go through step(). Runs on the thread of the io_context.
class Loop {
 public:
  struct Ports {
    std::function<Stamp()> ros_now;
    std::function<bool(Action&&)> carry_out;  // true: it was one for the middleware
    std::function<bool()> alone;  // there is one connection at most, handshakes included
    std::function<void(ConnectionId)> read_on;  // the next packet may come there
    std::function<void()> send;                 // sends the data of connections (Side::take_ready)
  };

  Loop(boost::asio::io_context& io, Side& side, Ports ports)
      : io_(io), side_(side), ports_(std::move(ports)), timer_(io) {}

  // The longest step since the last call.
  [[nodiscard]] Duration take_longest() { return std::exchange(longest_, Duration::zero()); }
  // The time of an input that arrives now.
  [[nodiscard]] Now now() const;

  // One step with one input. An input from inside an action (a login answered at once) waits until
  // this step has handled the earlier inputs.
  void feed(Input&& input);

  // Feeds the packet when its turn comes (Side::take_turn). The loop polls the sockets before each
  // packet, so that links with less use come first. The packet of the only connection is fed at
  // once.
  void arrived(PacketReceived&& packet);

  // The next packet for a connection that can take one; nullopt: none now. Data that waits for the
  // link's rate is pulled again at its time.
  std::optional<Packet> next_packet(ConnectionId connection, const Repairs& repairs);

  // One step with all inputs that `source` passes to its argument, so that messages that were ready
  // together are packed together. Returns the result of `source`.
  template <class Source>
  auto step(Source&& source) {
    begin_step();
    const auto result = source([this](Input&& input) { handle(std::move(input)); });
    end_step();
    return result;
  }

 private:
  void take(PacketReceived&& packet);
  [[nodiscard]] Now at(TimePoint steady) const;
  void begin_step();
  void handle(Input&& input);
  void end_step();
  void set_timer();
  void wait_until(TimePoint when);
  void plan_turn();
  // Polls the sockets so many times before the next packet has its turn.
  void look(int times);

  boost::asio::io_context& io_;
  Side& side_;
  const Ports ports_;
  boost::asio::steady_timer timer_;  // the core's next deadline
  std::optional<TimePoint> timer_at_;
  TimePoint reads_until_{};  // until then the timer waits, and sockets are read
  std::deque<Input> waiting_;
  TimePoint began_{};  // of the current step
  bool stepping_ = false;
  bool handled_ = false;  // this step has had an input
  bool sending_ = false;  // at the end of a step, which sets the timer itself
  bool turn_planned_ = false;
  StepCost cost_;
  Duration step_took_{};  // the last step, without the time that others took from the process
  Duration longest_{};
};

}  // namespace connect_bridge
