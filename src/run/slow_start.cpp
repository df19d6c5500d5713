#include "run/slow_start.hpp"

#include <utility>

namespace connect_bridge {

const char kSlowStartText[] =
    "ROS has not started within 10 s; still waiting. If a ROS program was killed, Fast DDS may "
    "wait "
    "for what it left in shared memory: end all ROS programs, then delete /dev/shm/fastdds_* and "
    "/dev/shm/sem.fastdds_* (fastrtps_* before Kilted).\n";

SlowStart::SlowStart(std::chrono::milliseconds patience, std::function<void()> say)
    : thread_([this, patience, say = std::move(say)] {
        std::unique_lock lock(mutex_);
        if (!changed_.wait_for(lock, patience, [this] { return ended_; })) say();
      }) {}

SlowStart::~SlowStart() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

}  // namespace connect_bridge
