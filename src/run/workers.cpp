#include "run/workers.hpp"

#include <new>
#include <utility>

#include "core/media/sample_codec.hpp"

namespace connect_bridge {
namespace {

JobDone carry_out(const CompressJob& job, const std::atomic<bool>& give_up) {
  JobDone done{job.job, std::nullopt};
  if (auto body = media::encode_sample(job.raw.view(), job.how, &give_up))
    done.result = Payload::adopt(std::move(*body));
  return done;
}

JobDone carry_out(const DecompressJob& job, const std::atomic<bool>&) {
  JobDone done{job.job, std::nullopt};
  auto raw = media::decode_sample(job.body.view(), job.codec, job.raw_bytes);
  if (raw) done.result = Payload::adopt(std::move(raw).value());
  return done;
}

std::size_t bytes_of(const JobDone& done) {
  return done.result ? done.result->size() : 0;
}

}  // namespace

Workers::Workers(unsigned threads, std::function<void(JobDone)> done) : done_(std::move(done)) {
  for (unsigned i = 0; i < threads; ++i) threads_.emplace_back([this] { run(); });
}

Workers::~Workers() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    waiting_.clear();
  }
  changed_.notify_all();
  for (auto& thread : threads_) thread.join();
}

void Workers::add(Job job) {
  {
    const std::lock_guard lock(mutex_);
    const JobTurn turn = std::visit([](const auto& j) { return j.turn; }, job);
    waiting_.add(turn.identity, turn.link, std::move(job));
  }
  changed_.notify_one();
}

void Workers::cancel(JobId job) {
  const std::lock_guard lock(mutex_);
  waiting_.erase_if([job](const Job& waiting) {
    return std::visit([job](const auto& j) { return j.job == job; }, waiting);
  });
}

void Workers::handled(const JobDone& done) {
  {
    const std::lock_guard lock(mutex_);
    unhandled_bytes_ -= bytes_of(done);
  }
  changed_.notify_one();
}

bool Workers::decodes_alone(const Job& job) {
  const auto* const decode = std::get_if<DecompressJob>(&job);
  return decode && (decode->codec == Codec::kPlanes || decode->codec == Codec::kCloud) &&
         decode->raw_bytes > kColumnsBesideMax;
}

void Workers::run() {
  for (;;) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] {
      return ending_ || (!waiting_.empty() && unhandled_bytes_ < kUnhandledBytesMax);
    });
    if (ending_) return;
    const Job job = *waiting_.take();
    lock.unlock();
    JobDone done{std::visit([](const auto& j) { return j.job; }, job), std::nullopt};
    std::unique_lock alone(alone_, std::defer_lock);
    if (decodes_alone(job)) alone.lock();
    try {
      done = std::visit([this](const auto& j) { return carry_out(j, ending_); }, job);
    } catch (const std::bad_alloc&) {  // handled like malformed data, or data that does not shrink
    }
    if (alone) alone.unlock();
    lock.lock();
    unhandled_bytes_ += bytes_of(done);
    lock.unlock();
    if (!ending_) done_(std::move(done));
  }
}

}  // namespace connect_bridge
