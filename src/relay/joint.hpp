// Two connections as one: what comes from one end goes to the other.
#pragma once

#include <array>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>

#include "core/base/bytes.hpp"
#include "net/tcp/transport.hpp"

namespace connect_bridge {

// Reads of one end only what the other one has taken, so little is under way here. The end of one
// direction passes through, and so does a reset: at once, or, of an end from which nothing is read
// since the other one does not take it, at the next look(). Once one direction has ended the other
// has kLastTime left. Thread: that of the io_context.
class Joint : public std::enable_shared_from_this<Joint> {
 public:
  static constexpr std::chrono::seconds kLastTime{10};

  // `passed`: what has been passed on is added there.
  Joint(TcpSocket visitor, TcpSocket robot, std::function<void(bool to_robot, std::size_t)> passed);
  // Once. `first`: goes to the robot before all else. `ended` is called once, when both ends are
  // closed.
  void start(Bytes first, std::function<void()> ended);
  // Whether an end is gone that is not read from; once a second.
  void look();
  // Resets both ends at once; `ended` is not called.
  void cut();

 private:
  struct End {
    explicit End(TcpSocket of) : socket(std::move(of)) {}
    TcpSocket socket;
    std::array<unsigned char, 16384> read{};  // and not yet written to the other end
    bool over = false;                        // it sends nothing more
    bool held = false;                        // not read, since the other end has not taken all
  };

  void pass(End& from, End& to);
  void write(End& from, End& to, asio::const_buffer bytes);
  void on_over(End& from, End& to);
  void finish(bool orderly);

  End visitor_, robot_;
  const std::function<void(bool, std::size_t)> passed_;
  Bytes first_;
  asio::steady_timer last_;
  std::function<void()> ended_;
};

}  // namespace connect_bridge
