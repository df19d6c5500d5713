// Gives robots' names to those who have shown a code for them, beside the loop.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/thread_pool.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "relay/robot_names.hpp"

namespace connect_bridge {

// A name is given by a change of a file: a lock that others may hold, and writes that reach the
// disk. One thread does so for one robot after the other; all pairs of the relay go on meanwhile.
// Its owner limits how many wait. Thread: that of the io_context, which outlives this object.
class NameDesk {
 public:
  // The robots as they are then; null: `problem` says why not.
  using Done =
      std::function<void(std::unique_ptr<Authenticator> robots, const std::string& problem)>;

  NameDesk(boost::asio::io_context& io, RobotNames::HandOver hand_over);
  // Waits for the one that is under way; the others are forgotten.
  ~NameDesk() = default;
  NameDesk(const NameDesk&) = delete;
  NameDesk& operator=(const NameDesk&) = delete;

  // `done` is called in the thread of the io_context, never from inside.
  void give(RobotNames::Taking taking, Done done);

 private:
  boost::asio::io_context& io_;
  const RobotNames::HandOver hand_over_;
  std::optional<boost::asio::thread_pool> thread_;  // from the first on; last: it uses the others
};

}  // namespace connect_bridge
