// A small thread pool for work that would delay the loop: compressing and decompressing large
// messages.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <variant>
#include <vector>

#include "core/base/turns.hpp"
#include "core/ports/ports.hpp"

namespace connect_bridge {

// Jobs are pure; a worker's thread passes their results to `done`. Identities take turns. The queue
// needs no limit: the core limits jobs to one per channel at a time, and cancels jobs of closed
// channels. The results need one: a few bytes can decompress to many, faster than the loop handles
// them.
class Workers {
 public:
  using Job = std::variant<CompressJob, DecompressJob>;
  // No job begins while so many bytes of results wait to be handled. So with two threads memory
  // holds at most these bytes, two messages in work, and one that is being handled.
  static constexpr std::size_t kUnhandledBytesMax = 8 << 20;
  // Decoding a picture or cloud takes four times its bytes. Above this size one is decoded at a
  // time.
  static constexpr std::size_t kColumnsBesideMax = 8 << 20;
  [[nodiscard]] static bool decodes_alone(const Job& job);

  Workers(unsigned threads, std::function<void(JobDone)> done);
  // Waits for the running jobs, which stop early if they would take long; forgets the waiting ones.
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  void add(Job job);  // any thread
  // Drops the job, if it has not begun. Any thread.
  void cancel(JobId job);
  // The result that `done` received has been handled. Call it once for each result. Any thread.
  void handled(const JobDone& done);

 private:
  void run();

  std::function<void(JobDone)> done_;
  std::mutex mutex_;
  std::mutex alone_;  // of who decodes a large picture or cloud; taken before mutex_
  std::condition_variable changed_;
  TurnsOfGroups<std::uint64_t, LinkId, Job> waiting_;
  std::size_t unhandled_bytes_ = 0;
  std::atomic<bool> ending_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace connect_bridge
