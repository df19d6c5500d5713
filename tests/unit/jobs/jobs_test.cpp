#include "core/jobs/jobs.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace connect_bridge {
namespace {

struct Owner final : JobOwner {
  void on_job(std::optional<Payload> result, const Now&) override {
    results.push_back(result ? result->size() : 0);
  }
  std::vector<std::size_t> results;
};

class JobsTest : public ::testing::Test {
 protected:
  JobId asked() {
    auto action = outputs.next();
    if (!action) return {};
    if (auto* compress = std::get_if<CompressJob>(&*action)) return compress->job;
    return std::get<DecompressJob>(*action).job;
  }
  void finish(JobId id, std::optional<Payload> result) {
    JobDone done{id, std::move(result)};
    jobs.on_done(done, Now{});
  }

  Outputs outputs;
  Jobs jobs{JobOptions{100}, outputs};
  Owner one, other;
};

TEST_F(JobsTest, TheOwnerAndNobodyElseIsTold) {
  auto first = jobs.compress(one, {Codec::kZstd, 1}, Payload::copy_of(Bytes(200)));
  auto second = jobs.decompress(other, Codec::kLz4, 300, Payload::copy_of(Bytes(20)), {1, {7}});
  const JobId a = asked();
  const JobId b = asked();
  finish(b, Payload::copy_of(Bytes(300)));
  finish(a, std::nullopt);
  EXPECT_EQ(one.results, (std::vector<std::size_t>{0}));
  EXPECT_EQ(other.results, (std::vector<std::size_t>{300}));
  finish(a, std::nullopt);
  EXPECT_EQ(one.results.size(), 1U);
}

// The codec's buffers keep their size when its pictures become smaller.
TEST_F(JobsTest, ACodecCountsAsItsLargestPicture) {
  Budget memory(1000);
  {
    Jobs::Pictures pictures(jobs, memory);
    EXPECT_TRUE(pictures.make_room(800));
    EXPECT_TRUE(pictures.make_room(10));
    EXPECT_EQ(memory.room(), 200U);
    EXPECT_FALSE(pictures.make_room(1001));
    EXPECT_EQ(memory.room(), 200U);
  }
  EXPECT_EQ(memory.room(), 1000U);
}

TEST_F(JobsTest, AResultThatNobodyWantsIsIgnored) {
  {
    const auto gone = jobs.compress(one, {Codec::kZstd, 1}, Payload::copy_of(Bytes(200)));
    EXPECT_TRUE(gone);
  }
  const JobId id = asked();
  const auto cancelled = outputs.next();
  ASSERT_TRUE(cancelled);
  EXPECT_EQ(std::get<CancelJob>(*cancelled).job, id);
  finish(id, std::nullopt);
  EXPECT_TRUE(one.results.empty());
}

// A peer must not be able to exhaust this process's ids: 32 bits of MirrorId and JobId would last
// some weeks only.
TEST_F(JobsTest, WhatThisProcessCountsHas64Bits) {
  EXPECT_EQ(sizeof(JobId), 8U);
  EXPECT_EQ(sizeof(MirrorId), 8U);
  EXPECT_EQ(sizeof(ConnectionId), 8U);
  EXPECT_EQ(sizeof(ChannelId), 4U);  // as on the wire
}

TEST_F(JobsTest, LargeIsWhatAWorkerDoes) {
  EXPECT_FALSE(jobs.is_large(99));
  EXPECT_TRUE(jobs.is_large(100));
}

}  // namespace
}  // namespace connect_bridge
