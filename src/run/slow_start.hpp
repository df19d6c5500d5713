// Says it if the middleware does not start.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace connect_bridge {

// Fast DDS waits without end for shared memory that a process did not finish before it was killed;
// the user would not know what holds up the start.
class SlowStart {
 public:
  static constexpr std::chrono::seconds kPatience{10};

  // `say` is called once, from another thread, unless this object ends within `patience`.
  SlowStart(std::chrono::milliseconds patience, std::function<void()> say);
  ~SlowStart();
  SlowStart(const SlowStart&) = delete;
  SlowStart& operator=(const SlowStart&) = delete;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool ended_ = false;
  std::thread thread_;  // last: it uses the others
};

// What a user can do, for the file descriptor 2.
extern const char kSlowStartText[];

}  // namespace connect_bridge
