#include "core/topics/picture_stream.hpp"

#include <algorithm>
#include <utility>

#include "core/topics/topic_offer.hpp"
#include "core/video/picture.hpp"

namespace connect_bridge {
namespace {

constexpr double kPictureShare = 0.95;  // of what the link carries in a period
constexpr double kPeriodMax = 0.15;     // seconds that a picture may take on the link
constexpr double kBasePeriods = 4;      // a base takes as long as so many others,
constexpr double kBaseMax = 0.3;        // and at most so many seconds
constexpr double kHandling = 0.002;     // seconds between worker and link
constexpr double kWaitMin = 0.001;
constexpr double kRateTime = 0.12;  // seconds of sending that tell the rate
constexpr double kLate = 0.1;       // a picture that takes longer tells it, too
constexpr double kLeastTime = 0.001;
// A transparent picture stays one, but one damaged JPEG says nothing of the next.
constexpr int kRefusedMax = 3;
constexpr Duration kLookAgain = std::chrono::milliseconds(50);

double seconds_of(Duration duration) {
  return std::chrono::duration<double>(duration).count();
}

std::uint32_t whole_bytes(double bytes) {
  constexpr double kMost = 1 << 30;
  return static_cast<std::uint32_t>(std::clamp(bytes, 1.0, kMost));
}

}  // namespace

void PictureStream::push(OutSample sample, const Now& now) {
  const OriginId origin = sample.subject.origin();
  Source& source = sources_.try_emplace(origin, context_.jobs, offer_.link().memory).first->second;
  const bool fits = source.pictures.make_room(video::encoder_bytes(sample.raw.view()));
  if (!fits) {  // mutant: picture_memory
    refused_[origin] = kRefusedMax;
    return offer_.lose(sample, DropReason::kMemory);
  }
  if (source.newest) offer_.lose(*source.newest, DropReason::kNewerAvailable);
  source.newest = std::move(sample);
  go(now);
}

void PictureStream::on_left(const Now& now) {
  if (!leaving_.empty()) {
    sent_.push_back({static_cast<double>(leaving_.front().bytes),
                     std::max(seconds_of(now.steady - leaving_since()), kLeastTime)});
    leaving_.pop_front();
    double time = 0;
    for (const Sent& sent : sent_) time += sent.seconds;
    while (time - sent_.front().seconds >= kRateTime) {
      time -= sent_.front().seconds;
      sent_.pop_front();
    }
    left_at_ = now.steady;
  }
  later_ = timers_.set(now.steady);  // mutant: picture_leaves
}

void PictureStream::on_time(const Now& now) {
  if (later_ && later_.at() <= now.steady) go(now);
}

void PictureStream::clear(DropReason reason) {
  cancel_job(reason);
  for (const auto& [origin, source] : sources_)
    if (source.newest) offer_.lose(*source.newest, reason);
  sources_.clear();
  refused_.clear();
  leaving_.clear();
  later_.cancel();
}

void PictureStream::forget(OriginId origin, DropReason reason) {
  const auto source = sources_.find(origin);
  if (source == sources_.end()) return;
  if (at_work_ && at_work_->sample.subject.origin() == origin) cancel_job(reason);
  if (source->second.newest) offer_.lose(*source->second.newest, reason);
  sources_.erase(source);
  if (next_source() != sources_.end()) later_ = timers_.set(TimePoint{});  // at once
}

void PictureStream::end(OriginId origin) {
  forget(origin, DropReason::kUnknownOrigin);
  refused_.erase(origin);
}

void PictureStream::cancel_job(DropReason reason) {
  job_.cancel();
  if (!at_work_) return;
  offer_.lose(at_work_->sample, reason);
  at_work_.reset();
}

bool PictureStream::takes(OriginId origin) const {
  const auto refused = refused_.find(origin);
  return refused == refused_.end() || refused->second < kRefusedMax;
}

bool PictureStream::holds(OriginId origin) const {
  const auto source = sources_.find(origin);
  return (source != sources_.end() && source->second.newest) ||
         (at_work_ && at_work_->sample.subject.origin() == origin);
}

std::size_t PictureStream::size() const {
  std::size_t waiting = at_work_ ? 1 : 0;
  for (const auto& [origin, source] : sources_) waiting += source.newest ? 1 : 0;
  return waiting;
}

std::uint64_t PictureStream::bytes() const {
  std::uint64_t bytes = at_work_ ? at_work_->sample.raw.size() : 0;
  for (const auto& [origin, source] : sources_)
    if (source.newest) bytes += source.newest->raw.size();
  return bytes;
}

TimePoint PictureStream::leaving_since() const {
  return std::max(leaving_.front().since, left_at_);
}

double PictureStream::rate(const Now& now) const {
  Sent all;
  for (const Sent& sent : sent_) {
    all.bytes += sent.bytes;
    all.seconds += sent.seconds;
  }
  const double rate = all.seconds > 0 ? all.bytes / all.seconds : 0;
  // A picture that is late shows that the link has become slower.
  const ChannelQueue* const queue = offer_.queue();
  const auto progress = queue ? queue->progress(now.steady) : std::nullopt;
  if (leaving_.empty() || !progress) return rate;
  const double time = seconds_of(now.steady - leaving_since());
  if (time < kLate) return rate;
  const double shown = static_cast<double>(progress->bytes) / time;
  return rate > 0 ? std::min(rate, shown) : shown;
}

// ---- one after the other

std::map<OriginId, PictureStream::Source>::iterator PictureStream::next_source() {
  auto next = sources_.end();
  for (auto it = sources_.begin(); it != sources_.end(); ++it)
    if (it->second.newest && (next == sources_.end() || it->second.turn < next->second.turn))
      next = it;
  return next;
}

void PictureStream::go(const Now& now) {
  later_.cancel();
  const auto next = next_source();
  const ChannelQueue* const queue = offer_.queue();
  // Another one in the queue could be replaced by this one.
  if (job_ || next == sources_.end() || !queue) return;
  // on_left() comes earlier, but not for what is dropped or is no picture.
  later_ = timers_.set(now.steady + kLookAgain);
  if (queue->oldest_waiting()) return;  // mutant: picture_displaced
  if (const std::uint64_t left = queue->left_bytes(); left > 0) {
    const double rate = this->rate(now);
    if (rate <= 0) return;
    const double slack = static_cast<double>(left) / rate - seconds_ - kHandling;
    if (slack >= kWaitMin) {
      later_ = timers_.set(
          now.steady + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(slack)));
      return;
    }
  }
  later_.cancel();
  begin(next->second, now);
}

void PictureStream::begin(Source& source, const Now& now) {
  note_drops();
  const double known = rate(now);
  const double rate = known > 0 ? known : std::max(offer_.channel_rate(now).rate, 1.0);
  const double bytes = kPictureShare * rate * std::clamp(fit_.interval(), kLeastTime, kPeriodMax);
  EncodePicture job;
  job.raw = source.newest->raw;
  job.base = source.base_due;
  job.bytes = whole_bytes(job.base ? std::min(kBasePeriods * bytes, kBaseMax * rate) : bytes);
  job.bytes_max = whole_bytes((job.base ? kBaseMax : kPeriodMax) * rate);
  job.turn = offer_.link().turn();
  source.turn = ++turns_;
  source.base_due = false;
  at_work_ = AtWork{*std::exchange(source.newest, std::nullopt), now.steady};
  job_ = source.pictures.encode(*this, std::move(job));
}

bool PictureStream::note_drops() {
  const std::uint64_t before = std::exchange(drops_, offer_.queue()->counts().dropped.total());
  if (drops_ == before) return false;
  for (auto& [origin, source] : sources_) source.base_due = true;  // mutant: base_after_drop
  leaving_.resize(offer_.queue()->is_open() && !leaving_.empty() ? 1 : 0);  // it goes on leaving
  return true;
}

void PictureStream::on_job(std::optional<Payload> result, const Now& now) {
  job_.cancel();
  const AtWork done = *std::exchange(at_work_, std::nullopt);
  const OriginId origin = done.sample.subject.origin();
  Source& source = sources_.at(origin);
  const auto facts = result ? video::facts_of(result->view()) : std::nullopt;
  if (!facts) {
    source.base_due = true;
    ++refused_[origin];
    offer_.lose(done.sample, DropReason::kNewerAvailable);
    return go(now);
  }
  // The mean moves by a quarter: one slow job, while others had the worker, shows little.
  seconds_ += (seconds_of(now.steady - done.since) - seconds_) / 4;
  if (note_drops() && !facts->base) {
    offer_.lose(done.sample, DropReason::kNewerAvailable);
    return go(now);
  }
  refused_.erase(origin);
  if (facts->base) source.base_due = false;
  leaving_.push_back({result->size(), now.steady});
  const Codec codec = facts->base ? Codec::kPictureBase : Codec::kPictureDelta;
  offer_.send(done.sample, codec, *result, now);
  note_drops();
  go(now);
}

}  // namespace connect_bridge
