// Why the last connection ended, or never began: for the status and the log.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "core/base/time.hpp"
#include "core/ports/failure.hpp"
#include "core/ports/outputs.hpp"

namespace connect_bridge {

// A client dials again until it is connected. The log gets a line for each new reason. While the
// reason stays the same, or two reasons take turns, it gets one after the first minute and then
// every ten minutes. After kNews different reasons (the answers of a proxy may contain numbers) it
// gets one only every ten minutes, and when a reason comes twice in a row. Single-threaded; owned
// by Links.
class LastFailure {
 public:
  static constexpr Duration kPeriod = std::chrono::minutes(10);
  static constexpr Duration kFirstPeriod = std::chrono::minutes(1);
  static constexpr Duration kTurn = std::chrono::minutes(2);  // of two reasons that take turns
  static constexpr int kNews = 10;

  // A line of the log is `what`, the text of the failure and `hint`.
  struct Line {
    LogLevel level = LogLevel::kWarn;
    std::string what;
    Failure why;
    std::string hint;
  };

  explicit LastFailure(Outputs& outputs) : outputs_(outputs) {}

  // Nothing: a link is open.
  [[nodiscard]] const Failure& last() const { return last_; }
  // A link was lost or refused here, and the log says so already.
  void set(Failure why, const Now& now);
  // A client's: a dial failed, or the server did not welcome it. A relay that limits visitors says
  // to each that its robot is absent (docs/protocol.md, "Limits"). So where TLS with the robot has
  // failed in the last kPeriod, that reason stays.
  void tell(Line line, const Now& now);
  // A link is open.
  void clear() {
    last_ = {};
    before_ = {};
    since_.reset();
    news_ = 0;
  }

 private:
  Outputs& outputs_;
  Failure last_;
  Failure before_;                  // another one, the last before
  TimePoint before_until_{};        // until then it takes turns
  std::optional<TimePoint> since_;  // since then no link is open
  TimePoint certified_until_{};     // until then a robot is not absent: its certificate failed
  TimePoint next_{};                // until then the same reason is not logged again
  int news_ = 0;                    // told, since a reason has stayed
  bool logged_ = true;              // the last one was
};

}  // namespace connect_bridge
