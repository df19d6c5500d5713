#include "run/workers.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <map>
#include <vector>

#include "core/compress/compress.hpp"
#include "core/video/picture.hpp"
#include "unit/media/samples.hpp"

namespace connect_bridge {
namespace {

const Bytes kRaw(10'000, 7);
const Compression kHow{Codec::kZstd, 3};

// Collects results until there are so many.
struct Results {
  std::function<void(JobDone)> taker() {
    return [this](JobDone done) {
      const std::lock_guard lock(mutex);
      by_job[done.job.value] = std::move(done.result);
      changed.notify_all();
    };
  }
  bool wait_for(std::size_t count,
                std::chrono::milliseconds time = std::chrono::milliseconds(30'000)) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, time, [&] { return by_job.size() >= count; });
  }
  JobDone of(std::uint64_t job) {
    const std::lock_guard lock(mutex);
    return {{job}, by_job[job]};
  }
  std::mutex mutex;
  std::condition_variable changed;
  std::map<std::uint64_t, std::optional<Payload>> by_job;
};

TEST(Workers, CompressAndDecompress) {
  Results results;
  Workers workers({.threads = 2}, results.taker());
  workers.add(CompressJob{{1}, kHow, Payload::adopt(Bytes(kRaw))});
  ASSERT_TRUE(results.wait_for(1));
  ASSERT_TRUE(results.by_job[1]);
  const Payload body = *results.by_job[1];
  EXPECT_LT(body.size(), kRaw.size());
  workers.add(DecompressJob{{2}, Codec::kZstd, static_cast<std::uint32_t>(kRaw.size()), body});
  ASSERT_TRUE(results.wait_for(2));
  const auto view = results.by_job[2].value().view();
  EXPECT_EQ(Bytes(view.begin(), view.end()), kRaw);
}

TEST(Workers, WhatDoesNotShrinkOrIsMalformedHasNoResult) {
  Results results;
  Workers workers({.threads = 2}, results.taker());
  workers.add(CompressJob{{1}, kHow, Payload::adopt({1, 2, 3})});
  workers.add(DecompressJob{{2}, Codec::kLz4, 100, Payload::adopt({1, 2, 3})});
  ASSERT_TRUE(results.wait_for(2));
  EXPECT_FALSE(results.by_job[1]);
  EXPECT_FALSE(results.by_job[2]);
}

TEST(Workers, EveryJobIsDoneOnce) {
  Results results;
  Workers workers({.threads = 4}, results.taker());
  for (std::uint32_t job = 1; job <= 500; ++job)
    workers.add(CompressJob{{job}, kHow, Payload::adopt(Bytes(kRaw))});
  EXPECT_TRUE(results.wait_for(500));
}

TEST(Workers, ResultsWaitUntilTheOnesBeforeAreHandled) {
  constexpr std::uint32_t kBytes = 2 << 20;
  const auto body = compress(ByteView{Bytes(kBytes, 7)}, kHow);
  ASSERT_TRUE(body);
  Results results;
  Workers workers({.threads = 1}, results.taker());
  for (std::uint32_t job = 1; job <= 8; ++job)
    workers.add(DecompressJob{{job}, Codec::kZstd, kBytes, Payload::adopt(Bytes(*body))});
  ASSERT_TRUE(results.wait_for(4));
  EXPECT_FALSE(results.wait_for(5, std::chrono::milliseconds(50)));
  for (std::uint32_t job = 1; job <= 4; ++job) workers.handled(results.of(job));
  EXPECT_TRUE(results.wait_for(8));
}

// The worker stands in its first job until the others are added.
struct Order {
  Order()
      : workers({.threads = 1}, [this](const JobDone& done) {
          gate.wait();
          results.taker()(done);
          const std::lock_guard lock(mutex);
          order.push_back(done.job.value);
        }) {}
  void add(std::uint64_t job, std::uint64_t identity) { add_of(job, identity, identity); }
  void add_of(std::uint64_t job, std::uint64_t identity, std::uint64_t link) {
    workers.add(CompressJob{
        {job}, kHow, Payload::adopt(Bytes(kRaw)), {identity, {static_cast<std::uint32_t>(link)}}});
  }
  std::vector<std::uint64_t> done(std::size_t count) {
    all_added.set_value();
    EXPECT_TRUE(results.wait_for(count));
    const std::lock_guard lock(mutex);
    return order;
  }

  std::promise<void> all_added;
  std::shared_future<void> gate = all_added.get_future().share();
  Results results;
  std::mutex mutex;
  std::vector<std::uint64_t> order;
  Workers workers;
};

// They take four times their bytes.
TEST(Workers, LargePicturesAndCloudsAreDecodedOneAtATime) {
  const auto alone = [](Codec codec, std::size_t raw_bytes) {
    return Workers::decodes_alone(
        DecompressJob{{1}, codec, static_cast<std::uint32_t>(raw_bytes), Payload::adopt({1})});
  };
  EXPECT_TRUE(alone(Codec::kPlanes, Workers::kColumnsBesideMax + 1));
  EXPECT_TRUE(alone(Codec::kCloud, Workers::kColumnsBesideMax + 1));
  EXPECT_FALSE(alone(Codec::kCloud, Workers::kColumnsBesideMax));
  EXPECT_FALSE(alone(Codec::kZstd, Workers::kColumnsBesideMax + 1));
  EXPECT_FALSE(Workers::decodes_alone(CompressJob{{1}, {Codec::kCloud, 1}, Payload::adopt({1})}));
  Results results;
  Workers workers({.threads = 2}, results.taker());
  constexpr auto kLarge = static_cast<std::uint32_t>(Workers::kColumnsBesideMax + 1);
  for (std::uint64_t i = 0; i < 20; ++i)
    workers.add(DecompressJob{{i}, Codec::kPlanes, kLarge, Payload::adopt({1, 2, 3})});
  EXPECT_TRUE(results.wait_for(20));
}

TEST(Workers, LinksTakeTurns) {
  Order order;
  order.add(1, 1);
  for (std::uint64_t job = 2; job <= 9; ++job) order.add(job, 1);
  order.add(10, 2);
  order.add(11, 0);
  const auto done = order.done(11);
  const auto place = [&](std::uint64_t job) {
    return std::find(done.begin(), done.end(), job) - done.begin();
  };
  EXPECT_LT(place(10), 4);
  EXPECT_LT(place(11), 4);
}

TEST(Workers, AnIdentityWithManyLinksHasTheTurnsOfOne) {
  Order order;
  order.add(1, 1);
  for (std::uint64_t job = 2; job <= 9; ++job) order.add_of(job, 1, job);  // each of another link
  order.add(10, 2);
  order.add(11, 2);
  const auto done = order.done(11);
  const auto place = [&](std::uint64_t job) {
    return std::find(done.begin(), done.end(), job) - done.begin();
  };
  EXPECT_LT(place(10), 4);
  EXPECT_LT(place(11), 6);
}

TEST(Workers, WhatIsCancelledDoesNotBegin) {
  Order order;
  for (std::uint64_t job = 1; job <= 9; ++job) order.add(job, job % 3);
  for (std::uint64_t job = 3; job <= 9; ++job) order.workers.cancel({job});
  const auto done = order.done(1);
  EXPECT_LE(done.size(), 2U);
}

TEST(Workers, TheEndForgetsWhatWaits) {
  const Payload large = Payload::adopt(Bytes(1 << 20, 7));
  std::promise<void> all_added;
  const auto gate = all_added.get_future().share();
  std::atomic<int> done = 0;
  {
    Workers workers({.threads = 1}, [&](const JobDone&) {
      gate.wait();
      ++done;
    });
    for (std::uint32_t job = 1; job <= 1000; ++job) workers.add(CompressJob{{job}, kHow, large});
    all_added.set_value();
  }
  EXPECT_LT(done, 1000);  // the thread has ended: nothing follows
}

TEST(Workers, WithoutWorkNothingHangs) {
  Results results;
  const Workers workers({.threads = 8}, results.taker());
}

// ---- pictures, by libvpx

Bytes picture(std::uint8_t grey) {
  return media::image_sample({64, 64, "mono8", 64, false, Bytes(64 * 64, grey)});
}

TEST(Workers, PicturesOfOneIdReferToEachOther) {
  if (!video::available()) GTEST_SKIP() << "built without libvpx";
  Results results;
  Workers workers({.threads = 1}, results.taker());
  workers.add(EncodePicture{{1}, {1}, Payload::adopt(picture(1)), 2000, 4000, false, {}});
  workers.add(EncodePicture{{2}, {1}, Payload::adopt(picture(2)), 2000, 4000, false, {}});
  ASSERT_TRUE(results.wait_for(2));
  const Payload base = results.of(1).result.value();
  const Payload delta = results.of(2).result.value();
  EXPECT_TRUE(video::facts_of(base.view())->base);
  EXPECT_FALSE(video::facts_of(delta.view())->base);
  const auto bytes = static_cast<std::uint32_t>(picture(0).size());
  workers.add(DecodePicture{{3}, {2}, bytes, delta, {}});  // what it refers to has not come
  workers.add(DecodePicture{{4}, {2}, bytes, base, {}});
  workers.add(DecodePicture{{5}, {2}, bytes, delta, {}});
  ASSERT_TRUE(results.wait_for(5));
  EXPECT_FALSE(results.of(3).result);
  EXPECT_TRUE(results.of(4).result);
  EXPECT_TRUE(results.of(5).result);
  workers.end({2});
  workers.add(DecodePicture{{6}, {2}, bytes, delta, {}});
  ASSERT_TRUE(results.wait_for(6));
  EXPECT_FALSE(results.of(6).result);
}

}  // namespace
}  // namespace connect_bridge
