// A small thread pool for work that would delay the loop: compressing and decompressing large
// messages, encoding and decoding pictures.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <variant>
#include <vector>

#include "core/base/turns.hpp"
#include "core/ports/ports.hpp"
#include "core/video/decoder.hpp"
#include "core/video/encoder.hpp"

namespace connect_bridge {

// Jobs are pure, but for those of pictures, which refer to the picture before; a worker's thread
// passes their results to `done`. Identities take turns. The queue
// needs no limit: the core limits jobs to one per channel at a time, and cancels jobs of closed
// channels. The results need one: a few bytes can decompress to many, faster than the loop handles
// them.
class Workers {
 public:
  using Job = std::variant<CompressJob, DecompressJob, EncodePicture, DecodePicture>;
  struct Options {
    unsigned threads = 1;
    int nice = 0;      // of the threads, added to the process's
    double cores = 0;  // processor time that all jobs may use in each second; 0: no limit
  };
  // No job begins while so many bytes of results wait to be handled. So with two threads memory
  // holds at most these bytes, two messages in work, and one that is being handled.
  static constexpr std::size_t kUnhandledBytesMax = 8 << 20;
  // Decoding a picture or cloud takes four times its bytes. Above this size one is decoded at a
  // time.
  static constexpr std::size_t kColumnsBesideMax = 8 << 20;
  [[nodiscard]] static bool decodes_alone(const Job& job);

  Workers(Options options, std::function<void(JobDone)> done);
  // Waits for the running jobs, which stop early if they would take long; forgets the waiting ones.
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  void add(Job job);  // any thread
  // Drops the job, if it has not begun. Any thread.
  void cancel(JobId job);
  // Forgets the pictures of this id. Any thread.
  void end(PictureId picture);
  // The result that `done` received has been handled. Call it once for each result. Any thread.
  void handled(const JobDone& done);

 private:
  // The codec of the pictures of one id, used by one job at a time.
  struct Codecs {
    std::optional<video::PictureEncoder> encoder;
    std::optional<video::PictureDecoder> decoder;
  };

  void run();
  // Takes the job that is next, once results and processor time allow it; nullopt: all ends.
  std::optional<Job> take(std::unique_lock<std::mutex>& lock);
  JobDone carry_out(const CompressJob& job);
  static JobDone carry_out(const DecompressJob& job);
  JobDone carry_out(const EncodePicture& job);
  JobDone carry_out(const DecodePicture& job);
  // Null: the pictures were forgotten meanwhile.
  std::shared_ptr<Codecs> codecs_of(PictureId picture);

  const Options options_;
  std::function<void(JobDone)> done_;
  std::mutex mutex_;
  std::mutex alone_;  // of who decodes a large picture or cloud; taken before mutex_
  std::condition_variable changed_;
  TurnsOfGroups<std::uint64_t, LinkId, Job> waiting_;
  std::map<PictureId, std::shared_ptr<Codecs>> codecs_;
  std::size_t unhandled_bytes_ = 0;
  // When the jobs that are done are paid for by `cores`.
  std::chrono::steady_clock::time_point paid_at_{};
  std::atomic<bool> ending_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace connect_bridge
