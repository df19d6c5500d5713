// Publishes large samples beside the loop.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/ports/actions.hpp"

namespace connect_bridge::ros {

class Publisher;

// The middleware takes some 0.8 ms for each MiB, in which it copies and sends the sample, and the
// check of its bytes as long. One thread does that, in the order in which samples come. Thread: all
// calls from the loop's.
class LargeSamples {
 public:
  static constexpr std::size_t kBytesMax = std::size_t{128} << 20;

  struct Sample {
    std::shared_ptr<Publisher> publisher;
    Publish what;
    std::optional<std::string> problem{};  // why it was not published
  };

  // `wake`: the loop is to look for what is done. Any thread.
  explicit LargeSamples(std::function<void()> wake) : wake_(std::move(wake)) {}
  // What waits is not published.
  ~LargeSamples();
  LargeSamples(const LargeSamples&) = delete;
  LargeSamples& operator=(const LargeSamples&) = delete;

  // Waits while more than kBytesMax wait here: then a subscriber takes them too slowly.
  void add(Sample sample);
  // What was published, or could not be, since the last call.
  std::vector<Sample> take_done();

 private:
  void run();

  const std::function<void()> wake_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable added_;
  std::condition_variable room_;
  std::deque<Sample> waiting_;
  std::size_t bytes_ = 0;  // of those that wait, and of the one that is being published
  std::vector<Sample> done_;
  bool stop_ = false;
  std::thread thread_;  // from the first sample on
};

}  // namespace connect_bridge::ros
