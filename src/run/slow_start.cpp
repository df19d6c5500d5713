#include "run/slow_start.hpp"

#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <utility>

namespace connect_bridge {

const char kSlowStartText[] =
    "ROS has not started within 10 s; still waiting. If a ROS program was killed, Fast DDS may "
    "wait "
    "for what it left in shared memory: end all ROS programs, then delete /dev/shm/fastdds_* and "
    "/dev/shm/sem.fastdds_* (fastrtps_* before Kilted).\n";

std::jthread says_if_slow(std::chrono::milliseconds patience, std::function<void()> say) {
  return std::jthread([patience, say = std::move(say)](const std::stop_token& ended) {
    std::mutex mutex;
    std::condition_variable_any changed;
    std::unique_lock lock(mutex);
    if (!changed.wait_for(lock, ended, patience, [&] { return ended.stop_requested(); })) say();
  });
}

}  // namespace connect_bridge
