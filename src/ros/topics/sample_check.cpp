#include "ros/topics/sample_check.hpp"

#include <utility>

#include "ros/topics/mirror.hpp"

namespace connect_bridge::ros {

SampleCheck::~SampleCheck() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  added_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void SampleCheck::add(Sample sample) {
  {
    std::unique_lock lock(mutex_);
    const std::size_t size = sample.what.payload.size();
    room_.wait(lock, [&] { return bytes_ == 0 || bytes_ + size <= kBytesMax; });
    bytes_ += size;
    waiting_.push_back(std::move(sample));
  }
  added_.notify_all();
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
}

std::optional<SampleCheck::Sample> SampleCheck::take() {
  const std::lock_guard lock(mutex_);
  if (checked_.empty()) return std::nullopt;
  std::optional<Sample> sample(std::move(checked_.front()));
  checked_.pop_front();
  return sample;
}

void SampleCheck::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    added_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
    if (stop_) return;
    Sample sample = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    sample.problem = sample.publisher->check(sample.what.payload.view());
    lock.lock();
    bytes_ -= sample.what.payload.size();
    room_.notify_all();
    checked_.push_back(std::move(sample));
    wake_();
  }
}

}  // namespace connect_bridge::ros
