// The topics that are to be read at once, whatever else of the graph is being read.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>

#include "core/base/time.hpp"

namespace connect_bridge::ros {

// The middleware may deliver a sample a moment before its graph shows the publisher, and that
// before the publisher's node, and several publishers may be asked for. So a topic is read a few
// times. Single-threaded.
class AskedTopics {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  static constexpr int kReadingsMax = 5;  // within kPause * (2^4 - 1), that is 150 ms
  static constexpr Duration kPause = std::chrono::milliseconds(10);  // it doubles

  void ask(const std::string& topic, TimePoint now) { topics_[topic] = {now, 0}; }
  // A topic that is to be read now, if any; the next one with the next call.
  [[nodiscard]] std::optional<std::string> take_due(TimePoint now);
  // When the next one is due.
  [[nodiscard]] std::optional<TimePoint> deadline() const;

 private:
  struct Asked {
    TimePoint due{};
    int readings = 0;
  };
  std::map<std::string, Asked> topics_;
};

}  // namespace connect_bridge::ros
