// The owners of robots' names, at a relay.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "access/login/authenticator.hpp"
#include "core/base/sha256.hpp"

namespace connect_bridge {

// The group of an entry whose token is the code of a line for a robot: it is no login, and works
// once.
inline constexpr char kLineGroup[] = "line";

// A name belongs to the token of its entry. Thread: one.
class RobotNames {
 public:
  // A robot that has shown the code of a registration command.
  struct Taking {
    std::string robot;
    Digest token;
    Digest code;
  };
  // From now on the name is this token's alone, if the code is still there: other relays, and
  // people, may have changed the robots. They as they are then; null: `problem` says why not. Takes
  // as long as a disk does, and is called by a thread of its own (NameDesk).
  using HandOver =
      std::function<std::unique_ptr<Authenticator>(const Taking& taking, std::string& problem)>;

  RobotNames() = default;
  // Identities are the robots' names.
  RobotNames(std::unique_ptr<Authenticator> robots, HandOver hand_over)
      : robots_(std::move(robots)), hand_over_(std::move(hand_over)) {}

  // `peer`: as in Attempt.
  [[nodiscard]] bool has(const std::string& robot, std::string_view token,
                         const std::string& peer) const;
  // The argument of hand_over() that makes the name this token's; nullopt: the code is not one for
  // it.
  [[nodiscard]] std::optional<Taking> taking(const std::string& robot, std::string_view token,
                                             std::string_view code, const std::string& peer) const;
  [[nodiscard]] const HandOver& hand_over() const { return hand_over_; }
  // The robots as hand_over() has left them.
  void use(std::unique_ptr<Authenticator> robots) { robots_ = std::move(robots); }
  [[nodiscard]] Refreshed refresh();

 private:
  std::unique_ptr<Authenticator> robots_;
  HandOver hand_over_;
};

}  // namespace connect_bridge
