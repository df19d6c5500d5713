// What docs/flow.md promises, on a path in virtual time.
#include "core/pacing/pacer.hpp"

#include <gtest/gtest.h>

#include "core/wire/frame.hpp"
#include "unit/flow/path_bed.hpp"

namespace connect_bridge::flow_test {
namespace {

using namespace std::chrono_literals;

TEST(Pacer, UrgentMessagesHardlyWaitBesideAnOverload) {
  const auto there = run_bed(thin_link()).there;
  EXPECT_LT(there.percentile_ms(0.5), 2.5);
  EXPECT_LT(there.percentile_ms(0.99), 6);
  EXPECT_GT(there.bulk_share, 0.94);
}

TEST(Pacer, WithoutATargetTheyWaitForSeconds) {
  auto options = thin_link();
  options.target = {};
  EXPECT_GT(run_bed(options).there.percentile_ms(0.5), 100);
}

TEST(Pacer, BothDirectionsMayBeFull) {
  auto options = thin_link();
  options.back.bulk_per_second = 20;
  const auto both = run_bed(options);
  for (const BedResult& one : {both.there, both.back}) {
    EXPECT_LT(one.percentile_ms(0.5), 3);
    EXPECT_LT(one.percentile_ms(0.99), 7);
    EXPECT_GT(one.bulk_share, 0.92);
  }
}

TEST(Pacer, WhatFitsIsNotSlowedDown) {
  auto options = thin_link();
  options.there.bulk_per_second = 3;
  const auto there = run_bed(options).there;
  EXPECT_GT(there.bulk_share, 3 * 500'000 * 8 / 18e6 * 0.98);
}

// Neither while the rate is looked for nor when a burst begins after a pause.
TEST(Pacer, BurstsThatFitMakeNoQueue) {
  for (const double rate : {18, 58}) {
    for (const double per_second : {1, 2, 5, 10}) {
      for (const std::uint32_t bytes : {100'000U, 500'000U}) {
        auto options = thin_link();
        options.there.rate = megabits(rate);
        options.there.bulk_bytes = bytes;
        options.there.bulk_per_second = per_second;
        options.lasts = 25s;
        options.warm_up = 5s;
        const double share = bytes * 8 * per_second / (rate * 1e6);
        if (share > 0.9) continue;
        const auto there = run_bed(options).there;
        EXPECT_LT(there.percentile_ms(0.99), 4) << rate << ' ' << bytes << ' ' << per_second;
        EXPECT_GT(there.bulk_share, 0.98 * share) << rate << ' ' << bytes << ' ' << per_second;
      }
    }
  }
}

TEST(Pacer, FindsMoreRateAndGivesWay) {
  auto options = thin_link();
  options.there.rate = [](Duration at) { return (at < 4s ? 58 : at < 8s ? 2 : 18) * 1e6 / 8; };
  options.there.bulk_per_second = 20;
  options.lasts = 12s;
  const auto there = run_bed(options).there;
  // Data that was under way when the path became slower takes its time, whatever the sender does.
  EXPECT_LT(there.worst_ms(5100ms, 8s), 20);
  EXPECT_LT(there.worst_ms(9s, 12s), 10);
  EXPECT_GT(there.bulk_share, 0.9);
}

TEST(Pacer, AcknowledgementsMayComeInBunches) {
  auto options = thin_link();
  options.there.bunch = options.back.bunch = 10ms;
  const auto there = run_bed(options).there;
  EXPECT_LT(there.percentile_ms(0.99), 20);
  EXPECT_GT(there.bulk_share, 0.9);
}

// 2 ms would be a tenth of the round trip.
TEST(Pacer, OnAShortPathTheQueueIsShorterStill) {
  for (const std::uint32_t segment : {0, 1448}) {
    for (const double rate : {18, 58}) {
      auto options = thin_link();
      options.there.rate = megabits(rate);
      options.there.bulk_per_second = rate;
      options.there.segment_bytes = segment;
      const auto there = run_bed(options).there;
      EXPECT_LT(there.percentile_ms(0.5), 1.5) << rate << ' ' << segment;
      EXPECT_LT(there.percentile_ms(0.99), 3.5) << rate << ' ' << segment;
      EXPECT_GT(there.bulk_share, 0.94) << rate << ' ' << segment;
    }
  }
}

TEST(Pacer, ADelayThatShakesIsNotTakenForAQueue) {
  auto options = thin_link();
  options.there.jitter = options.back.jitter = 10ms;
  options.there.delay = options.back.delay = 20ms;
  EXPECT_GT(run_bed(options).there.bulk_share, 0.65);
}

// On both ways: data waits behind a lost packet, and so do acknowledgements.
TEST(Pacer, LostPacketsDoNotSlowItDown) {
  auto options = thin_link();
  for (const double loss : {0.003, 0.01, 0.03}) {
    options.there.loss = options.back.loss = loss;
    const auto there = run_bed(options).there;
    EXPECT_LT(there.percentile_ms(0.5), 6) << loss;
    EXPECT_LT(there.percentile_ms(0.99), 60) << loss;
    EXPECT_GT(there.bulk_share, 0.9) << loss;
  }
}

TEST(Pacer, GivesWayOnAPathThatLosesPackets) {
  auto options = thin_link();
  options.there.rate = [](Duration at) { return (at < 4s || at > 8s ? 18 : 4) * 1e6 / 8; };
  options.there.loss = options.back.loss = 0.01;
  const auto some = run_bed(options).there;
  EXPECT_LT(some.worst_ms(5s, 8s), 40);
  EXPECT_GT(some.bulk_share, 0.9);
  // Nearly all data waits for a repair, and only that could show the queue.
  options.there.loss = options.back.loss = 0.1;
  const auto many = run_bed(options).there;
  EXPECT_LT(many.worst_ms(5s, 8s), 250);
  EXPECT_GT(many.bulk_share, 0.7);
}

// Another cell, another route: the delay that does not go away is not a queue of somebody else.
TEST(Pacer, APathThatBecomesLongerStaysWithoutAQueue) {
  for (const Duration detour : {10ms, 25ms, 100ms}) {
    auto options = thin_link();
    options.there.detour = options.back.detour = detour;
    options.there.detour_at = options.back.detour_at = 4s;
    const auto there = run_bed(options).there;
    EXPECT_LT(there.worst_ms(8s, 15s), 30) << detour.count();
    EXPECT_GT(there.bulk_share, 0.8) << detour.count();
  }
}

// Now it is longer and slower: what is measured then is no rate of somebody else's.
TEST(Pacer, APathThatBecomesLongerAndSlowerStaysWithoutAQueue) {
  for (const double rate : {9, 4, 2}) {
    auto options = thin_link();
    options.there.detour = options.back.detour = 100ms;
    options.there.detour_at = options.back.detour_at = 4s;
    options.there.rate = [&](Duration at) { return (at < 4s ? 18 : rate) * 1e6 / 8; };
    options.lasts = 20s;
    const auto there = run_bed(options).there;
    EXPECT_LT(there.worst_ms(5s, 20s), 80) << rate;
    EXPECT_GT(there.bulk_share, 0.8) << rate;
  }
}

// What is on its way then takes up to 2.2 s, whatever the sender does. A part takes up to 24 ms.
TEST(Pacer, APathThatNearlyStopsGetsNoQueueOfOurs) {
  for (const double rate : {0.2, 0.225, 0.25, 0.3, 0.4}) {
    auto options = thin_link();
    options.there.rate = [&](Duration at) { return (at < 4s ? 18 : rate) * 1e6 / 8; };
    options.lasts = 30s;
    const auto there = run_bed(options).there;
    EXPECT_LT(there.worst_ms(8s, 30s), 250) << rate;
    EXPECT_GT(there.bulk_share, 0.9) << rate;
  }
}

TEST(Pacer, AVeryThinLinkCarriesBoth) {
  auto options = thin_link();
  options.there.rate = options.back.rate = megabits(2);
  options.there.delay = options.back.delay = 60ms;
  const auto there = run_bed(options).there;
  EXPECT_LT(there.percentile_ms(0.5), 12);
  EXPECT_GT(there.bulk_share, 0.85);
}

TEST(Pacer, AFastLinkIsFilled) {
  auto options = thin_link();
  options.there.rate = options.back.rate = megabits(400);
  options.there.delay = options.back.delay = 20ms;
  options.there.bulk_per_second = 200;
  const auto there = run_bed(options).there;
  EXPECT_LT(there.percentile_ms(0.99), 10);
  EXPECT_GT(there.bulk_share, 0.95);
}

TEST(Pacer, AStandingPathIsFollowedByFreshTraffic) {
  auto options = thin_link();
  options.there.rate = [](Duration at) { return at > 6s && at < 8s ? 0.0 : 18e6 / 8; };
  const auto there = run_bed(options).there;
  EXPECT_LT(there.worst_ms(8500ms, 15s), 10);
  EXPECT_GT(there.bulk_share, 0.9);  // of what could be carried
}

// Packets that leave one by one, each acknowledged before the next, still show a rate.
TEST(Pacer, AShortPathIsFilledAgainAfterItWasSlow) {
  Pacer pacer(2ms);
  std::uint64_t sent = 0;
  TimePoint now{1s};
  const auto cross = [&](Duration one_way) {
    now = std::max(now, pacer.next_at(now));
    const auto bytes = pacer.part_bytes(256 << 10);
    sent += bytes;
    pacer.sent({sent, bytes, now, true, true});
    now += one_way;
    pacer.acknowledged({sent, now.time_since_epoch().count()}, now + 100us);
    now += 100us;
  };
  while (now < TimePoint{2s}) cross(100us);
  const double before = pacer.rate();
  while (now < TimePoint{4s}) cross(60ms);
  ASSERT_LT(pacer.rate(), before / 10);
  while (now < TimePoint{6s}) cross(100us);
  EXPECT_GT(pacer.rate(), before / 2);
}

// A late acknowledgement says when the last byte arrived, which may be that of a time frame.
TEST(Pacer, WhatArrivesBetweenIsNotTakenForAQueue) {
  Pacer pacer(2ms);
  pacer.sent({100, 100, TimePoint{0ms}, true, false});
  pacer.acknowledged({100, 10'000'000}, TimePoint{20ms});
  pacer.sent({200, 100, TimePoint{1000ms}, false, false});
  pacer.acknowledged({240, 1'095'000'000}, TimePoint{1110ms});
  EXPECT_EQ(pacer.queue(), 0ms);
}

// After a pause the rate is that of what came behind it.
TEST(Pacer, APauseIsNoPartOfTheRate) {
  Pacer pacer(2ms);
  std::uint64_t sent = 1000;
  pacer.sent({sent, 1000, TimePoint{0ms}, true, false});
  pacer.acknowledged({sent, 10'000'000}, TimePoint{20ms});
  sent += 50;
  pacer.sent({sent, 50, TimePoint{30ms}, false, false});  // alone, acknowledged late
  for (int i = 1; i <= 40; ++i) pacer.sent({sent + i * 1000U, 1000, TimePoint{200ms}, true, true});
  pacer.acknowledged({sent, 40'000'000}, TimePoint{205ms});
  for (int i = 1; i <= 40; ++i) {
    const Duration arrived = 210ms + i * 1ms;
    pacer.acknowledged({sent + i * 1000U, arrived.count()}, TimePoint{arrived + 10ms});
    if (pacer.rate() > 0) {
      EXPECT_GT(pacer.rate(), 900'000);
    }
  }
  EXPECT_NEAR(pacer.rate(), 1'000'000, 100'000);
}

// Behind a lost packet all arrives at once, when it has been sent again.
TEST(Pacer, WhatArrivesInABunchAfterThePathStoodIsNoRate) {
  Pacer pacer(2ms);
  std::uint64_t sent = 0;
  std::uint64_t arrived = 0;
  const auto arrive = [&](Duration at) {
    arrived += 1000;
    pacer.acknowledged({arrived, at.count()}, TimePoint{at + 10ms});
  };
  Duration now{};
  for (; now < 500ms; now += 1ms) {
    sent += 1000;
    pacer.sent({sent, 1000, TimePoint{now}, true, true});
    if (now >= 60ms) arrive(now - 10ms);
  }
  EXPECT_NEAR(pacer.rate(), 1'000'000, 100'000);
  now += 200ms;
  while (arrived < sent) arrive(now += 1ms);
  EXPECT_LT(pacer.rate(), 300'000);
}

// One packet a millisecond; that of 490 ms is lost, and its repetition arrives at 520 ms.
TEST(Pacer, WhatWaitsForARepairIsNoQueue) {
  Pacer pacer(2ms);
  const auto send = [&](Duration at) {
    const auto sent = static_cast<std::uint64_t>(at / 1ms + 1) * 1000;
    pacer.sent({sent, 1000, TimePoint{at}, true, true});
  };
  const auto acknowledge = [&](Duration sent, Duration arrived) {
    const auto bytes = static_cast<std::uint64_t>(sent / 1ms + 1) * 1000;
    pacer.acknowledged({bytes, arrived.count()}, TimePoint{arrived + 10ms});
  };
  for (Duration now{}; now < 510ms; now += 1ms) {
    send(now);
    if (now >= 20ms) acknowledge(now - 20ms, now - 10ms);
  }
  const double rate = pacer.rate();
  for (Duration now = 510ms; now < 530ms; now += 1ms) {
    pacer.repairs({.open = true, .under_way_bytes = 20'000, .repeated = 1});
    EXPECT_NE(pacer.next_at(TimePoint{now}), Pacer::kNever);
    send(now);
  }
  pacer.repairs({.open = false, .under_way_bytes = 20'000, .repeated = 1});
  for (Duration sent = 490ms; sent < 510ms; sent += 1ms) {
    acknowledge(sent, 520ms);
    EXPECT_EQ(pacer.queue(), 0ms);
    EXPECT_EQ(pacer.rate(), rate);
  }
}

// Messages that fit leave at once, one by one, and none is ever waiting; now they do not fit.
TEST(Pacer, AQueueOfSmallMessagesShowsThatThePathIsSlower) {
  auto options = thin_link();
  options.there.rate = [](Duration at) { return (at < 5s ? 58 : 2) * 1e6 / 8; };
  options.there.bulk_bytes = 20'000;
  options.there.bulk_per_second = 25;
  options.lasts = 20s;
  const auto there = run_bed(options).there;
  EXPECT_LT(there.worst_ms(10s, 20s), 150);
}

TEST(Pacer, AMessageAloneLeavesAtOnce) {
  Pacer pacer(2ms);
  const TimePoint now{1s};
  EXPECT_EQ(pacer.next_at(now), now);
  EXPECT_FALSE(pacer.wants_ack(56, false, TimePoint(100ms)));
  EXPECT_TRUE(pacer.wants_ack(56, false, now));  // once a second
}

// A peer's clock may do anything: stand still, run backwards, or jump. It goes as it should in the
// first `from` milliseconds, and then by `step`.
void lies(Stamp step, int from) {
  Pacer pacer(2ms);
  std::uint64_t sent = 0;
  Stamp arrived = Stamp{1} << 60;
  for (int i = 0; i < 5000; ++i) {
    const TimePoint now{i * 1ms};
    if (pacer.next_at(now) > now) continue;
    sent += 1000;
    pacer.sent({sent, 1000, now, true, true});
    arrived = std::clamp(arrived + (i < from ? Stamp{1'000'000} : step), Stamp{0}, kWireStampMax);
    pacer.acknowledged({sent, arrived}, now + 500us);
  }
  EXPECT_GT(sent, 100'000U) << step;
  EXPECT_GE(pacer.part_bytes(256 << 10), 600U);
}

TEST(Pacer, WhatAPeerSaysOfItsClockDoesNoHarm) {
  for (const int from : {0, 2000}) {
    for (const Stamp step : {Stamp{0}, Stamp{-1'000'000}, Stamp{1} << 50, kWireStampMax / 4})
      lies(step, from);
  }
}

// What a path of 58, 18 or 2 Mbit/s carries in a millisecond is five segments, one and a half, or a
// part of one.
TEST(Pacer, PartsFillSegments) {
  const auto part_bytes = [](double rate, std::uint32_t segment) {
    Pacer pacer(2ms);
    pacer.repairs({.segment_bytes = segment});
    std::uint64_t sent = 0;
    for (TimePoint now{1s}; now < TimePoint{2s}; now += 1ms) {
      const auto bytes = static_cast<std::uint32_t>(rate / 1000);
      sent += bytes;
      pacer.sent({sent, bytes, now, true, true});
      pacer.acknowledged({sent, (now + 10ms).time_since_epoch().count()}, now + 20ms);
    }
    return pacer.part_bytes(256 << 10);
  };
  EXPECT_EQ(part_bytes(58e6 / 8, 1448), 5 * 1448 - 88);
  EXPECT_EQ(part_bytes(18e6 / 8, 1448), 1448 - 88);
  EXPECT_EQ(part_bytes(9e6 / 8, 1448), 1448 - 88);
  EXPECT_EQ(part_bytes(2e6 / 8, 1448), 600);
  EXPECT_EQ(part_bytes(18e6 / 8, 0), 2250);
}

TEST(Pacer, WhoNeverAcknowledgesGetsLittle) {
  Pacer pacer(2ms);
  std::uint64_t sent = 0;
  const TimePoint now{1s};
  while (pacer.next_at(now) <= now && sent < 1 << 20) {
    const auto bytes = pacer.part_bytes(256 << 10);
    sent += bytes;
    pacer.sent({sent, bytes, now, pacer.wants_ack(bytes, true, now), true});
  }
  EXPECT_EQ(sent, 32U << 10);
  EXPECT_EQ(pacer.next_at(TimePoint(1h)), TimePoint(1h + 100ms));  // a loss may be why none comes
}

}  // namespace
}  // namespace connect_bridge::flow_test
