// Checks large samples beside the loop.
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

// To see that the bytes of a sample have its type takes some 0.5 ms for each MiB, and of many
// nested messages ten times as much. One thread does that, in the order in which samples come; the
// loop publishes them, as Fast DDS delays what others publish meanwhile more if another thread
// does. Thread: all calls from the loop's.
class SampleCheck {
 public:
  // Of all samples here, checked or not. Each counts for kSampleCost besides its bytes, so that
  // there are at most 16,384.
  static constexpr std::size_t kBytesMax = std::size_t{128} << 20;
  static constexpr std::size_t kSampleCost = std::size_t{8} << 10;

  struct Sample {
    std::shared_ptr<Publisher> publisher;
    Publish what;
    std::optional<std::string> problem{};  // why it is not to be published
  };

  // `wake`: the loop is to look for what is checked. Any thread.
  explicit SampleCheck(std::function<void()> wake) : wake_(std::move(wake)) {}
  // What waits is not published.
  ~SampleCheck();
  SampleCheck(const SampleCheck&) = delete;
  SampleCheck& operator=(const SampleCheck&) = delete;

  // Of a payload of so many bytes. Where there is no room for it: waits for the first sample that
  // is checked, and takes it. Call it until it gives none, and then add().
  std::optional<Sample> make_room(std::size_t bytes);
  void add(Sample sample);
  // The first that is checked and was not taken yet.
  std::optional<Sample> take();

 private:
  std::optional<Sample> take_locked();
  void run();

  const std::function<void()> wake_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable added_;
  std::condition_variable done_;
  std::deque<Sample> waiting_;
  std::size_t bytes_ = 0;  // what all count for: those that wait, are being checked, or are checked
  std::deque<Sample> checked_;
  bool stop_ = false;
  std::thread thread_;  // from the first sample on
};

}  // namespace connect_bridge::ros
