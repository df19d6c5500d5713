#include "core/jobs/encoder.hpp"

#include <gtest/gtest.h>

#include "core/compress/compress.hpp"

namespace connect_bridge {
namespace {

Encoder::Options options(std::uint32_t depth = 0, std::uint64_t queue_bytes_max = 1 << 20) {
  return {{Codec::kZstd, 3}, depth, queue_bytes_max};
}

// From 1000 bytes on a worker compresses. Samples are told by their stamp. "3:zstd" is ready, "3!"
// dropped, "job 1" given to the worker.
struct EncoderScript final : JobOwner {
  explicit EncoderScript(Encoder::Options o = options()) : encoder(o, jobs, *this) {}

  // `state`: of which the sample is the newest, taken `at` so many ms.
  void push(Stamp stamp, std::size_t size, std::optional<std::uint64_t> state = {}, int at = 0) {
    OutSample sample{{1}, stamp, 0, Payload::adopt(Bytes(size, 7)), {{1}}};
    sample.state = state;
    sample.taken = TimePoint{} + std::chrono::milliseconds(at);
    std::vector<OutSample> dropped;
    for (auto& displaced : encoder.push(std::move(sample)))
      dropped.push_back(std::move(displaced.sample));
    drop(dropped);
    take_ready();
  }
  void done(std::uint32_t job, bool shrunk = true) {
    JobDone result{{job}, std::nullopt};
    if (shrunk) result.result = Payload::adopt({1, 2, 3});
    jobs.on_done(result, {});
  }
  void on_job(std::optional<Payload> result, const Now&) override {
    encoder.finish(std::move(result));
    take_ready();
  }
  void clear() { drop(encoder.clear()); }
  std::string took_place() {
    while (const auto action = outputs.next()) {
      if (const auto* job = std::get_if<CompressJob>(&*action))
        say("job " + std::to_string(job->job.value));
      if (const auto* job = std::get_if<CancelJob>(&*action))
        say("cancel " + std::to_string(job->job.value));
    }
    return std::exchange(line, {});
  }

  Outputs outputs;
  Jobs jobs{{1000}, outputs};
  Encoder encoder;
  Bytes last;  // body that was ready

 private:
  void say(const std::string& word) { line += (line.empty() ? "" : " ") + word; }
  void take_ready() {
    while (const auto ready = encoder.next()) {
      const bool raw = ready->codec == Codec::kNone;
      EXPECT_EQ(raw, ready->body.size() == ready->sample.raw.size());
      say(std::to_string(ready->sample.stamp) + (raw ? ":none" : ":zstd"));
      last.assign(ready->body.view().begin(), ready->body.view().end());
    }
  }
  void drop(const std::vector<OutSample>& samples) {
    for (const auto& sample : samples) say(std::to_string(sample.stamp) + "!");
  }
  std::string line;
};

TEST(Encoder, SmallSamplesAreCompressedAtOnce) {
  EncoderScript script;
  script.push(1, 999);
  EXPECT_EQ(script.took_place(), "1:zstd");
  EXPECT_EQ(script.encoder.bytes(), 0U);
}

TEST(Encoder, WhatDoesNotShrinkGoesAsItIs) {
  EncoderScript script;
  script.push(1, 3);
  script.push(2, 0);
  EXPECT_EQ(script.took_place(), "1:none 2:none");
}

TEST(Encoder, TheBodyIsTheCompressedSample) {
  EncoderScript script;
  script.push(1, 500);
  EXPECT_EQ(decompress(script.last, Codec::kZstd, 500).value(), Bytes(500, 7));
}

TEST(Encoder, LargeSamplesAreTheWorkers) {
  EncoderScript script;
  script.push(1, 1000);
  EXPECT_EQ(script.took_place(), "job 1");
  EXPECT_EQ(script.encoder.bytes(), 1000U);
  script.done(1);
  EXPECT_EQ(script.took_place(), "1:zstd");
  EXPECT_EQ(script.encoder.bytes(), 0U);
}

TEST(Encoder, AJobThatDidNotShrinkDeliversTheSample) {
  EncoderScript script;
  script.push(1, 1000);
  script.done(1, false);
  EXPECT_EQ(script.took_place(), "1:none job 1");  // the job was given first, and is read last
}

TEST(Encoder, OrderIsKeptWhileTheWorkerIsBusy) {
  EncoderScript script;
  script.push(1, 2000);
  script.push(2, 10);
  script.push(3, 3000);
  script.push(4, 10);
  EXPECT_EQ(script.took_place(), "job 1");
  EXPECT_EQ(script.encoder.bytes(), 5020U);
  script.done(1);
  EXPECT_EQ(script.took_place(), "1:zstd 2:none job 2");
  script.done(2);
  EXPECT_EQ(script.took_place(), "3:zstd 4:none");
  EXPECT_EQ(script.encoder.bytes(), 0U);
}

TEST(Encoder, OtherJobsAreNotOurs) {
  EncoderScript script;
  script.done(1);
  script.push(1, 1000);
  script.done(7);
  EXPECT_EQ(script.took_place(), "job 1");
  script.done(1);
  script.done(1);
  EXPECT_EQ(script.took_place(), "1:zstd");
}

TEST(Encoder, BeyondTheDepthTheOldestWaitingOneGoes) {
  EncoderScript script(options(2));
  for (Stamp stamp = 1; stamp <= 5; ++stamp) script.push(stamp, 1000);
  EXPECT_EQ(script.took_place(), "2! 3! job 1");
  script.done(1);
  script.done(2);
  script.done(3);
  EXPECT_EQ(script.took_place(), "1:zstd 4:zstd 5:zstd job 2 job 3");
}

TEST(Encoder, BeyondTheBytesTheOldestWaitingOneGoesButTheNewestStays) {
  EncoderScript script(options(0, 2500));
  script.push(1, 9000);  // with the worker: not counted
  script.push(2, 1500);
  script.push(3, 1000);
  EXPECT_EQ(script.took_place(), "job 1");
  script.push(4, 1);
  EXPECT_EQ(script.took_place(), "2!");
  script.push(5, 9000);
  EXPECT_EQ(script.took_place(), "3! 4!");
  EXPECT_EQ(script.encoder.bytes(), 18'000U);
  script.done(1);
  script.done(2);
  EXPECT_EQ(script.took_place(), "1:zstd 5:zstd job 2");
}

TEST(Encoder, ClearDropsAllAndTheLateJobIsNobodys) {
  EncoderScript script;
  script.push(1, 1000);
  script.push(2, 10);
  script.push(3, 1000);
  script.clear();
  EXPECT_EQ(script.took_place(), "1! 2! 3! job 1 cancel 1");
  EXPECT_EQ(script.encoder.bytes(), 0U);
  script.done(1);
  script.push(4, 1000);
  script.done(1);
  script.done(2);
  EXPECT_EQ(script.took_place(), "4:zstd job 2");
}

TEST(Encoder, ALinkCanBeForgotten) {
  EncoderScript script;
  script.push(1, 1000);
  script.push(2, 1000);
  EXPECT_EQ(script.encoder.forget({2}).size(), 0U);
  EXPECT_EQ(script.encoder.bytes(), 2000U);
  EXPECT_EQ(script.encoder.forget({1}).size(), 2U);
  EXPECT_EQ(script.encoder.bytes(), 1000U);  // nobody wants what waited; a worker has the other
  EXPECT_EQ(script.encoder.forget({1}).size(), 0U);
}

TEST(Encoder, WhatWaitsForLongIsReplacedByANewerSampleOfItsState) {
  EncoderScript script;
  script.push(1, 1000, 5, 0);  // with the worker
  script.push(2, 1000, 5, 10);
  script.push(3, 1000, 6, 20);
  script.push(4, 1000, 5, 100);  // a burst
  EXPECT_EQ(script.took_place(), "job 1");
  script.push(5, 1000, 5, 120);
  EXPECT_EQ(script.took_place(), "2! 4!");
  script.push(6, 1000, {}, 500);
  EXPECT_EQ(script.took_place(), "");
}

}  // namespace
}  // namespace connect_bridge
