#include "run/workers.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <new>
#include <utility>

#include "core/base/overloaded.hpp"
#include "core/media/sample_codec.hpp"

namespace connect_bridge {
namespace {

// Jobs may use so much more at once than `cores` gives them.
constexpr std::chrono::milliseconds kBurst{100};

JobDone done_with(JobId job, std::optional<Bytes> result) {
  if (!result) return {job, std::nullopt};
  return {job, Payload::adopt(*std::move(result))};
}

// Processor time of the calling thread.
std::chrono::nanoseconds thread_time() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

std::size_t bytes_of(const JobDone& done) {
  return done.result ? done.result->size() : 0;
}

}  // namespace

Workers::Workers(Options options, std::function<void(JobDone)> done)
    : options_(options), done_(std::move(done)) {
  for (unsigned i = 0; i < options_.threads; ++i) threads_.emplace_back([this] { run(); });
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
    const PictureId picture =
        std::visit(Overloaded{[](const EncodePicture& j) { return j.picture; },
                              [](const DecodePicture& j) { return j.picture; },
                              [](const auto&) { return PictureId{}; }},
                   job);
    if (picture && !codecs_.contains(picture)) codecs_[picture] = std::make_shared<Codecs>();
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

void Workers::end(PictureId picture) {
  const std::lock_guard lock(mutex_);
  codecs_.erase(picture);
}

std::shared_ptr<Workers::Codecs> Workers::codecs_of(PictureId picture) {
  const std::lock_guard lock(mutex_);
  const auto codecs = codecs_.find(picture);
  return codecs == codecs_.end() ? nullptr : codecs->second;
}

// ---- the threads

JobDone Workers::carry_out(const CompressJob& job) {
  return done_with(job.job, media::encode_sample(job.raw.view(), job.how, &ending_));
}

JobDone Workers::carry_out(const DecompressJob& job) {
  auto raw = media::decode_sample(job.body.view(), job.codec, job.raw_bytes);
  return done_with(job.job, raw ? std::optional(std::move(raw).value()) : std::nullopt);
}

JobDone Workers::carry_out(const EncodePicture& job) {
  const auto codecs = codecs_of(job.picture);
  if (!codecs) return {job.job, std::nullopt};
  if (!codecs->encoder) codecs->encoder.emplace();
  return done_with(job.job,
                   codecs->encoder->encode(job.raw.view(), {job.bytes, job.bytes_max, job.base}));
}

JobDone Workers::carry_out(const DecodePicture& job) {
  const auto codecs = codecs_of(job.picture);
  if (!codecs) return {job.job, std::nullopt};
  if (!codecs->decoder) codecs->decoder.emplace();
  auto raw = codecs->decoder->decode(job.body.view(), job.raw_bytes);
  return done_with(job.job, raw ? std::optional(std::move(raw).value()) : std::nullopt);
}

std::optional<Workers::Job> Workers::take(std::unique_lock<std::mutex>& lock) {
  const auto may_begin = [this] {
    return ending_ || (!waiting_.empty() && unhandled_bytes_ < kUnhandledBytesMax);
  };
  for (;;) {
    changed_.wait(lock, may_begin);
    changed_.wait_until(lock, paid_at_ - kBurst, [this] { return ending_.load(); });
    if (ending_) return std::nullopt;
    if (may_begin()) return waiting_.take();  // it may have been cancelled meanwhile
  }
}

void Workers::run() {
  // A thread of its own has its own niceness on Linux.
  if (options_.nice != 0) setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), options_.nice);
  for (;;) {
    std::unique_lock lock(mutex_);
    const auto job = take(lock);
    if (!job) return;
    lock.unlock();
    const auto before = thread_time();
    JobDone done{std::visit([](const auto& j) { return j.job; }, *job), std::nullopt};
    std::unique_lock alone(alone_, std::defer_lock);
    if (decodes_alone(*job)) alone.lock();
    try {
      done = std::visit([this](const auto& j) { return this->carry_out(j); }, *job);
    } catch (const std::bad_alloc&) {  // handled like malformed data, or data that does not shrink
    }
    if (alone) alone.unlock();
    lock.lock();
    if (options_.cores > 0)
      paid_at_ = std::max(paid_at_, std::chrono::steady_clock::now()) +
                 std::chrono::duration_cast<std::chrono::nanoseconds>((thread_time() - before) /
                                                                      options_.cores);
    unhandled_bytes_ += bytes_of(done);
    lock.unlock();
    if (!ending_) done_(std::move(done));
  }
}

}  // namespace connect_bridge
