// Messages that are encoded against the previous one, and decoded at the other end.
#include <gtest/gtest.h>

#include "core/compress/compress.hpp"
#include "core/flow/delta_decoder.hpp"
#include "core/flow/delta_encoder.hpp"

namespace connect_bridge {
namespace {

constexpr double kThin = 1e6;  // bytes per second
const Compression kAuto{.automatic = true};

// A message of noise that is its own for each `seed`, and `last` as its end.
Payload noise(std::size_t size, std::uint8_t seed, std::uint8_t last = 0) {
  Bytes bytes;
  std::uint32_t state = seed + 1U;
  for (std::size_t i = 0; i < size; ++i) {
    state = state * 1664525 + 1013904223;
    bytes.push_back(static_cast<std::uint8_t>(state >> 24));
  }
  bytes.back() = last;
  return Payload::adopt(std::move(bytes));
}

// Half noise, so that it shrinks by itself.
Payload telling(std::uint8_t seed, std::uint8_t last = 0, std::size_t size = 1000) {
  Bytes bytes(size, 7);
  const auto half = noise(size / 2, seed);
  std::copy(half.view().begin(), half.view().end(), bytes.begin());
  bytes.back() = last;
  return Payload::adopt(std::move(bytes));
}

struct Ends {
  // The codec with which it is sent, or kNone. It is sent completely.
  Codec send(Payload raw, double rate = kThin, std::uint32_t origin = 1, std::uint16_t demand = 1) {
    const DeltaEncoder::Message message{OriginId{origin}, demand, raw};
    auto body = encoder.encode(message, rate);
    last = {};
    last.subject = OriginId{origin};
    last.raw_bytes = static_cast<std::uint32_t>(raw.size());
    last.body = body ? body->bytes : raw;
    last.codec = body ? body->codec : Codec::kNone;
    encoder.sent(message, last.codec, body ? std::move(body->room) : Budget::Hold{});
    return last.codec;
  }
  // The last one, as it is read; empty: not at all.
  Bytes read(bool wanted = true) {
    const auto raw = decoder.decode(last, wanted);
    if (!raw || !raw.value()) return {};
    return {raw.value()->view().begin(), raw.value()->view().end()};
  }

  Budget ours, theirs;
  DeltaEncoder encoder{kAuto, true, ours};
  DeltaDecoder decoder{theirs};
  InMessage last;
};

Bytes bytes_of(const Payload& payload) {
  return {payload.view().begin(), payload.view().end()};
}

TEST(Delta, WhatIsNewCrosses) {
  Ends e;
  EXPECT_EQ(e.send(telling(1)), Codec::kZstdBase);
  EXPECT_EQ(e.read(), bytes_of(telling(1)));
  for (std::uint8_t i = 1; i < 10; ++i) {
    EXPECT_EQ(e.send(telling(1, i)), Codec::kZstdDelta);
    EXPECT_LT(e.last.body.size(), 60U);
    EXPECT_EQ(e.read(), bytes_of(telling(1, i)));
  }
}

TEST(Delta, EachOriginAndDemandHasItsOwn) {
  Ends e;
  e.send(telling(1));
  e.read();
  EXPECT_EQ(e.send(telling(2), kThin, 2), Codec::kZstdBase);
  EXPECT_EQ(e.read(), bytes_of(telling(2)));
  EXPECT_EQ(e.send(telling(1, 1)), Codec::kZstdDelta);
  EXPECT_EQ(e.read(), bytes_of(telling(1, 1)));
  EXPECT_EQ(e.send(telling(1, 2), kThin, 1, 2), Codec::kZstdBase);
  e.encoder.forget(OriginId{2});
  EXPECT_EQ(e.send(telling(2), kThin, 2), Codec::kZstdBase);
}

TEST(Delta, AutomaticallyOnlyWhereItIsSooner) {
  for (const auto& [rate, codec] : {std::pair{0.0, Codec::kNone}, std::pair{1e6, Codec::kZstdBase},
                                    std::pair{100e6, Codec::kNone}}) {
    Ends e;
    EXPECT_EQ(e.send(telling(1), rate), codec) << rate;
  }
}

TEST(Delta, WhatDoesNotShrinkIsTriedNowAndThen) {
  Ends e;
  for (int i = 0; i < 1000; ++i)
    EXPECT_EQ(e.send(noise(1000, static_cast<std::uint8_t>(i))), Codec::kNone);
  EXPECT_EQ(e.send(telling(1)), Codec::kNone);  // it is not looked at
  // Once it shrinks it is noticed, and stays so.
  int smaller = 0;
  for (int i = 0; i < 200; ++i)
    smaller += e.send(telling(1, static_cast<std::uint8_t>(i))) != Codec::kNone ? 1 : 0;
  EXPECT_GT(smaller, 100);
}

TEST(Delta, SmallAndLargeOnesAreLeftAlone) {
  Ends e;
  EXPECT_EQ(e.send(telling(1, 0, DeltaEncoder::kBytesMin - 2)), Codec::kNone);
  EXPECT_EQ(e.send(telling(1, 0, DeltaEncoder::kBytesMax + 2)), Codec::kNone);
}

TEST(Delta, NowAndThenOneStandsForItself) {
  Ends e;
  std::uint32_t bases = 0;
  for (std::uint32_t i = 0; i < 3 * (DeltaEncoder::kDeltasMax + 1); ++i) {
    bases += e.send(telling(1, static_cast<std::uint8_t>(i))) == Codec::kZstdBase;
    EXPECT_FALSE(e.read().empty());
  }
  EXPECT_EQ(bases, 3U);
}

TEST(Delta, OneThatIsNotWantedTakesItsSuccessorsAlong) {
  Ends e;
  e.send(telling(1));
  EXPECT_TRUE(e.read(false).empty());
  e.send(telling(1, 1));
  ASSERT_EQ(e.last.codec, Codec::kZstdDelta);
  const auto raw = e.decoder.decode(e.last, true);
  ASSERT_TRUE(raw);  // not an error
  EXPECT_FALSE(raw.value());
  e.encoder.clear();
  e.send(telling(1, 2));
  EXPECT_FALSE(e.read().empty());
}

TEST(Delta, AWrongBaseIsFoundOut) {
  Ends e;
  e.send(telling(1));
  e.read();
  e.send(telling(2, 0));  // against the first; the other end does not get it
  e.send(telling(2, 1));
  const auto raw = e.decoder.decode(e.last, true);
  ASSERT_FALSE(raw);
  EXPECT_EQ(raw.error().code, CloseCode::kMalformed);
}

TEST(Delta, WithoutABaseOrAChecksumItIsMalformed) {
  Ends e;
  e.send(telling(1));
  e.send(telling(1, 1));
  ASSERT_EQ(e.last.codec, Codec::kZstdDelta);
  EXPECT_EQ(e.decoder.decode(e.last, true).error().code, CloseCode::kMalformed);
  EXPECT_EQ(e.decoder.decode(e.last, false).error().code, CloseCode::kMalformed);
  const auto raw = telling(1);
  EXPECT_FALSE(decompress_delta(*compress(raw.view(), {Codec::kZstd, 3}), {}, raw.size()));
}

TEST(Delta, BothEndsKeepToTheBytesOfALink) {
  Ends e;
  std::uint32_t origin = 0;
  while (e.send(telling(1, 0, DeltaEncoder::kBytesMax), kThin, ++origin) == Codec::kZstdBase) {
    EXPECT_FALSE(e.read().empty());
    ASSERT_LT(origin, 1000U);
  }
  EXPECT_EQ(e.last.codec, Codec::kZstd);  // it leaves no state
  EXPECT_LE(e.ours.used(), kBasesBytesMax);
  EXPECT_EQ(e.ours.used(), e.theirs.used());
  e.last.codec = Codec::kZstdBase;
  const auto raw = telling(1, 0, kBaseBytesMax);
  e.last.raw_bytes = kBaseBytesMax;
  e.last.body = Payload::adopt(*compress_delta(raw.view(), {}, 3));
  EXPECT_EQ(e.decoder.decode(e.last, true).error().code, CloseCode::kTooLarge);
  e.decoder.clear();
  EXPECT_EQ(e.theirs.used(), 0U);
}

// Messages of many channels may be partly sent at a time.
TEST(Delta, WhatIsUnderWayCountsAsTheBaseThatItWillBe) {
  Ends e;
  std::vector<DeltaEncoder::Body> under_way;
  const auto raw = telling(1, 0, DeltaEncoder::kBytesMax);
  Codec codec = Codec::kZstdBase;
  for (std::uint32_t origin = 1; codec == Codec::kZstdBase && origin < 1000; ++origin) {
    under_way.push_back(e.encoder.encode({OriginId{origin}, 1, raw}, kThin).value());
    codec = under_way.back().codec;
  }
  EXPECT_EQ(codec, Codec::kZstd);
  EXPECT_LE(e.ours.used(), kBasesBytesMax);
  under_way.clear();  // dropped
  EXPECT_EQ(e.ours.used(), 0U);
}

TEST(Delta, ManyThatAreNotWantedAreBoundedToo) {
  Ends e;
  e.send(telling(1));
  Result<std::optional<Payload>> raw = std::optional<Payload>{};
  for (e.last.subject = {1}; raw && e.last.subject.value < 1'000'000; ++e.last.subject.value)
    raw = e.decoder.decode(e.last, false);
  EXPECT_EQ(raw.error().code, CloseCode::kTooLarge);
  EXPECT_LT(e.last.subject.value, 40'000U);
}

}  // namespace
}  // namespace connect_bridge
