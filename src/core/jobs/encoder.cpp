#include "core/jobs/encoder.hpp"

#include "core/compress/compress.hpp"

namespace connect_bridge {

void Encoder::push(OutSample sample, Outputs& outputs, const Deliver& deliver, const Drop& drop) {
  if (!busy_) return encode(std::move(sample), outputs, deliver);
  waiting_bytes_ += sample.raw.size();
  waiting_.push_back(std::move(sample));
  while (waiting_.size() > 1 && ((options_.depth > 0 && waiting_.size() > options_.depth) ||
                                 waiting_bytes_ > options_.queue_bytes_max)) {
    drop(waiting_.front());
    waiting_bytes_ -= waiting_.front().raw.size();
    waiting_.pop_front();
  }
}

void Encoder::encode(OutSample sample, Outputs& outputs, const Deliver& deliver) {
  if (sample.raw.size() >= options_.job_bytes) {
    job_ = outputs.new_job();
    outputs.push(CompressJob{job_, options_.how, sample.raw});
    busy_ = std::move(sample);
    return;
  }
  if (auto body = compress(sample.raw.view(), options_.how))
    return deliver(sample, options_.how.codec, Payload::adopt(std::move(*body)));
  deliver(sample, Codec::kNone, sample.raw);
}

bool Encoder::on_job(const JobDone& done, Outputs& outputs, const Deliver& deliver) {
  if (!busy_ || done.job != job_) return false;
  const OutSample sample = std::move(*busy_);
  busy_.reset();
  deliver(sample, done.result ? options_.how.codec : Codec::kNone,
          done.result ? *done.result : sample.raw);
  while (!busy_ && !waiting_.empty()) {
    OutSample next = std::move(waiting_.front());
    waiting_.pop_front();
    waiting_bytes_ -= next.raw.size();
    encode(std::move(next), outputs, deliver);
  }
  return true;
}

void Encoder::clear(const Drop& drop) {
  if (busy_) drop(*busy_);
  for (const auto& sample : waiting_) drop(sample);
  busy_.reset();
  waiting_.clear();
  waiting_bytes_ = 0;
}

}  // namespace connect_bridge
