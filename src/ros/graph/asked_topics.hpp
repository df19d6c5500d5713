// Topics that must be read at once, whatever other part of the graph is being read.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>

#include "core/base/time.hpp"

namespace connect_bridge::ros {

// The middleware may deliver a sample shortly before its graph shows the publisher, and the
// publisher before its node; and several publishers may be unknown. So each requested topic is read
// a few times. Single-threaded.
class AskedTopics {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  static constexpr int kReadingsMax = 5;  // within kPause * (2^4 - 1) = 150 ms
  static constexpr Duration kPause = std::chrono::milliseconds(10);  // doubles each time

  void ask(const std::string& topic, TimePoint now) { topics_[topic] = {now, 0}; }
  // Takes one topic that is due; nullopt: none is.
  [[nodiscard]] std::optional<std::string> take_due(TimePoint now);
  // The time when the next topic is due.
  [[nodiscard]] std::optional<TimePoint> deadline() const;

 private:
  struct Asked {
    TimePoint due{};
    int readings = 0;
  };
  std::map<std::string, Asked> topics_;
};

}  // namespace connect_bridge::ros
