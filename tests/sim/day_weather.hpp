// What disturbs the two sides of a day, one thing after the other: cuts of the connection above
// all, stalls, another path, restarts, clocks that are set.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sim/checker.hpp"
#include "sim/host.hpp"
#include "sim/middleware.hpp"
#include "sim/network.hpp"
#include "sim/rng.hpp"

namespace connect_bridge::sim {

class DayWeather {
 public:
  struct World {
    Schedule& schedule;
    Middleware& middleware;
    Network& network;
    Checker& checker;
    const std::vector<std::unique_ptr<Host>>& hosts;  // the server, the client
  };

  DayWeather(const World& world, Rng rng, bool verbose);

  // Whether the next disturbance ends a process, and with it what that one remembers.
  [[nodiscard]] bool ends_process() const;
  // Lasts until it is over. `restarts`: whether the one after it may end a process.
  void disturb(bool restarts);
  void restart(Host& host);
  // From now on no graph loses best-effort samples.
  void end_loss();
  // The path is well, until the next disturbance.
  void rest();

  // Of a connection that was open.
  [[nodiscard]] std::uint64_t cuts() const;
  // How many of each kind there were.
  [[nodiscard]] std::string text() const;

 private:
  enum class Kind : std::uint8_t {
    kCut,
    kStall,
    kPath,
    kClientRestart,
    kServerRestart,
    kClock,
    kGraphLoss,
    kTrouble,
    kCount
  };
  static constexpr std::size_t kKinds = static_cast<std::size_t>(Kind::kCount);

  void draw(bool restarts);
  void run_for(Duration how_long);
  [[nodiscard]] Duration outage();
  void cut();
  void stall();
  void change_path();
  void set_clock();

  World world_;
  Rng rng_;
  bool verbose_;
  bool loses_ = true;
  Kind next_ = Kind::kCut;
  std::array<std::uint64_t, kKinds> counts_{};
};

}  // namespace connect_bridge::sim
