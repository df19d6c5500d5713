#include "ros/topics/sample_check.hpp"

#include <new>
#include <utility>

#include "ros/topics/topic_mirror.hpp"

namespace connect_bridge::ros {
namespace {

std::size_t cost_of(const SampleCheck::Sample& sample) {
  return sample.what.payload.size() + SampleCheck::kSampleCost;
}

}  // namespace

SampleCheck::~SampleCheck() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  added_.notify_all();
  if (thread_.joinable()) thread_.join();
}

std::optional<SampleCheck::Sample> SampleCheck::make_room(std::size_t bytes) {
  std::unique_lock lock(mutex_);
  if (bytes_ == 0 || bytes_ + bytes + kSampleCost <= kBytesMax) return std::nullopt;
  done_.wait(lock, [this] { return !checked_.empty(); });
  return take_locked();
}

void SampleCheck::add(Sample sample) {
  {
    const std::lock_guard lock(mutex_);
    bytes_ += cost_of(sample);
    waiting_.push_back(std::move(sample));
  }
  added_.notify_all();
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
}

std::optional<SampleCheck::Sample> SampleCheck::take() {
  const std::lock_guard lock(mutex_);
  return take_locked();
}

std::optional<SampleCheck::Sample> SampleCheck::take_locked() {
  if (checked_.empty()) return std::nullopt;
  std::optional<Sample> sample(std::move(checked_.front()));
  checked_.pop_front();
  bytes_ -= cost_of(*sample);
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
    try {
      sample.problem = sample.publisher->check(sample.what.payload.view());
    } catch (const std::bad_alloc&) {  // a sample may ask for much
      sample.problem = "no memory left";
    }
    lock.lock();
    checked_.push_back(std::move(sample));
    done_.notify_all();
    wake_();
  }
}

}  // namespace connect_bridge::ros
