// Checks large samples on a thread beside the loop.
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

#include "core/ports/actions.hpp"

namespace connect_bridge::ros {

class Publisher;

// Checking the bytes of a sample takes some 0.5 ms per MiB, and ten times as much for many nested
// messages. One thread does this, in the order of the samples. The loop publishes them: Fast DDS
// delays samples of others more if another thread publishes. All calls come from the loop's thread.
class SampleCheck {
 public:
  // Limit of all samples here, checked or not. Each counts kSampleCost in addition to its bytes, so
  // there are at most 16,384.
  static constexpr std::size_t kBytesMax = std::size_t{128} << 20;
  static constexpr std::size_t kSampleCost = std::size_t{8} << 10;

  struct Sample {
    std::shared_ptr<Publisher> publisher;
    Publish what;
    std::optional<std::string> problem{};  // the reason not to publish it
  };

  // `wake` is called on any thread when a sample was checked.
  explicit SampleCheck(std::function<void()> wake) : wake_(std::move(wake)) {}
  // Drops waiting samples.
  ~SampleCheck();
  SampleCheck(const SampleCheck&) = delete;
  SampleCheck& operator=(const SampleCheck&) = delete;

  // Makes room for a payload of this size. Without room, waits for the first checked sample and
  // returns it. Call it until it returns none, and then add().
  std::optional<Sample> make_room(std::size_t bytes);
  void add(Sample sample);
  // The first checked sample that was not taken yet.
  std::optional<Sample> take();

 private:
  std::optional<Sample> take_locked();
  void run();

  const std::function<void()> wake_;
  std::mutex mutex_;  // guards the members up to stop_
  std::condition_variable added_;
  std::condition_variable done_;
  std::deque<Sample> waiting_;
  std::size_t bytes_ = 0;  // sum for all samples: waiting, in the check, and checked
  std::deque<Sample> checked_;
  bool stop_ = false;
  std::thread thread_;  // exists from the first sample on
};

}  // namespace connect_bridge::ros
