// A day of one bridge: two sides live through 24 hours of weather. Each disturbance ends, and some
// seconds later they must be linked again. Once an hour nothing happens for a minute: then nothing
// may be stuck, and the memory in use must be what it was hours ago.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sim/crowd.hpp"
#include "sim/day_weather.hpp"
#include "sim/expectation.hpp"
#include "sim/service_crowd.hpp"
#include "sim/service_expectation.hpp"
#include "sim/stream_check.hpp"

namespace connect_bridge::sim {

class Day {
 public:
  // The parts of the world that lives through it.
  struct World {
    Schedule& schedule;
    Middleware& middleware;
    Services& services;
    Network& network;
    Checker& checker;
    Crowd& crowd;
    ServiceCrowd& service_crowd;
    Expectation& expectation;
    ServiceExpectation& service_expectation;
    const std::vector<std::unique_ptr<Host>>& hosts;
  };

  Day(const World& world, Rng rng, bool verbose);

  // Throws Violation.
  void run();
  void on_delivery(const Reader& reader, const Writer& mirror, const Sample& sample) {
    streams_.on_delivery(reader, mirror, sample);
  }
  // How much of everything there was.
  [[nodiscard]] std::string text() const;

 private:
  void run_for(Duration how_long);
  void begin_last_hour();
  void disturb(bool restarts);
  void check_linked() const;
  void rest();
  void check_empty(const Host& host) const;
  // Calls do not wait for places that are free.
  void watch_places();
  void weigh();
  // All that was judged long ago.
  void forget();

  World world_;
  Rng rng_;
  bool verbose_;
  bool over_ = false;
  DayWeather weather_;
  StreamCheck streams_;
  std::map<std::pair<int, std::string>, TimePoint> waits_;  // (host, service): since when
  std::vector<std::size_t> heap_;                           // bytes in use, at each rest
};

}  // namespace connect_bridge::sim
