#include "core/compress/compress.hpp"

#include <gtest/gtest.h>
#include <lz4.h>
#include <zstd.h>

#include <random>
#include <thread>

namespace connect_bridge {
namespace {

constexpr Compression kLz4{Codec::kLz4, 0};
constexpr Compression kZstd{Codec::kZstd, 3};

// Numbers that resemble a ROS message: small steps, repeated structure.
Bytes steps(std::size_t size) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i / 64 * (i % 4));
  return bytes;
}

Bytes random_bytes(std::size_t size) {
  std::mt19937 random{1};
  Bytes bytes(size);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
  return bytes;
}

CloseCode code_of(const Result<Bytes>& result) {
  return result.ok() ? CloseCode::kNormal : result.error().code;
}

class EveryCodec : public testing::TestWithParam<Compression> {};
INSTANTIATE_TEST_SUITE_P(Compress, EveryCodec,
                         testing::Values(kLz4, kZstd, Compression{Codec::kZstd, 1},
                                         Compression{Codec::kZstd, 19},
                                         Compression{Codec::kZstd, -7},
                                         Compression{Codec::kZstd, 1000}));

TEST_P(EveryCodec, ReturnsWhatWentIn) {
  for (const std::size_t size : {100U, 1000U, 65536U, 300'000U}) {
    const Bytes raw = steps(size);
    const auto body = compress(raw, GetParam());
    ASSERT_TRUE(body.has_value()) << size;
    EXPECT_LT(body->size(), raw.size());
    EXPECT_EQ(body->capacity(), body->size());
    const auto out = decompress(*body, GetParam().codec, raw.size());
    ASSERT_TRUE(out.ok()) << out.error().message;
    EXPECT_EQ(out.value(), raw);
  }
}

TEST(Compress, InPiecesItIsTheSameForTheReceiver) {
  const std::atomic<bool> no = false;
  for (const std::size_t size : {600'000U, 1U << 20U, 3'000'001U}) {
    const Bytes raw = steps(size);
    const auto body = compress(raw, kZstd, &no);
    ASSERT_TRUE(body.has_value()) << size;
    const auto out = decompress(*body, Codec::kZstd, raw.size());
    ASSERT_TRUE(out.ok()) << out.error().message;
    EXPECT_EQ(out.value(), raw);
    EXPECT_FALSE(compress(random_bytes(size), kZstd, &no).has_value());
  }
}

TEST(Compress, ALargeMessageCanBeGivenUp) {
  const std::atomic<bool> yes = true;
  EXPECT_FALSE(compress(steps(1 << 20), kZstd, &yes).has_value());
  EXPECT_TRUE(compress(steps(1000), kZstd, &yes).has_value());  // not worth it
}

TEST_P(EveryCodec, DeclinesWhatDoesNotShrink) {
  EXPECT_FALSE(compress({}, GetParam()).has_value());
  EXPECT_FALSE(compress(Bytes{1}, GetParam()).has_value());
  EXPECT_FALSE(compress(random_bytes(10'000), GetParam()).has_value());
}

TEST_P(EveryCodec, RefusesEveryOtherSizeThanTheAnnounced) {
  const Bytes raw = steps(1000);
  const Bytes body = compress(raw, GetParam()).value();
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, raw.size() - 1, raw.size() + 1,
                                 std::size_t{1} << 31, std::size_t{1} << 40}) {
    EXPECT_EQ(code_of(decompress(body, GetParam().codec, size)), CloseCode::kMalformed) << size;
  }
}

TEST_P(EveryCodec, RefusesWhatIsCutShortOrContinued) {
  const Bytes raw = steps(1000);
  Bytes body = compress(raw, GetParam()).value();
  for (std::size_t size = 0; size < body.size(); ++size) {
    EXPECT_FALSE(decompress(ByteView{body}.first(size), GetParam().codec, raw.size()).ok()) << size;
  }
  body.push_back(0);
  EXPECT_FALSE(decompress(body, GetParam().codec, raw.size()).ok());
}

TEST_P(EveryCodec, WorksInSeveralThreads) {
  const auto work = [] {
    for (int i = 0; i < 20; ++i) {
      const Bytes raw = steps(5000 + static_cast<std::size_t>(i));
      const auto body = compress(raw, GetParam());
      ASSERT_TRUE(body.has_value());
      EXPECT_EQ(decompress(*body, GetParam().codec, raw.size()).value(), raw);
    }
  };
  std::thread other{work};
  work();
  other.join();
}

TEST(Compress, NoneIsNoCompression) {
  EXPECT_FALSE(compress(steps(1000), {Codec::kNone, 3}).has_value());
  EXPECT_EQ(code_of(decompress(Bytes{1}, Codec::kNone, 1)), CloseCode::kMalformed);
}

TEST(Compress, OneCodecDoesNotReadTheOther) {
  const Bytes raw = steps(1000);
  EXPECT_FALSE(decompress(compress(raw, kLz4).value(), Codec::kZstd, raw.size()).ok());
  EXPECT_FALSE(decompress(compress(raw, kZstd).value(), Codec::kLz4, raw.size()).ok());
}

// A zstd body must be one frame that states its size: everything else hides what it grows to.
TEST(Compress, ZstdRefusesOtherFramesThanOneOfKnownSize) {
  const Bytes raw = steps(1000);
  const Bytes body = compress(raw, kZstd).value();

  Bytes twice = body;
  twice.insert(twice.end(), body.begin(), body.end());
  EXPECT_FALSE(decompress(twice, Codec::kZstd, 2 * raw.size()).ok());
  EXPECT_FALSE(decompress(twice, Codec::kZstd, raw.size()).ok());

  Bytes skippable{0x50, 0x2a, 0x4d, 0x18, 4, 0, 0, 0, 1, 2, 3, 4};
  EXPECT_FALSE(decompress(skippable, Codec::kZstd, 4).ok());
  skippable.insert(skippable.end(), body.begin(), body.end());
  EXPECT_FALSE(decompress(skippable, Codec::kZstd, raw.size()).ok());

  Bytes unsized(ZSTD_compressBound(raw.size()));
  ZSTD_CCtx* context = ZSTD_createCCtx();
  ZSTD_CCtx_setParameter(context, ZSTD_c_contentSizeFlag, 0);
  unsized.resize(ZSTD_compress2(context, unsized.data(), unsized.size(), raw.data(), raw.size()));
  ZSTD_freeCCtx(context);
  EXPECT_FALSE(decompress(unsized, Codec::kZstd, raw.size()).ok());
}

// 13 bytes that announce 4 GiB: refused before anything of that size exists.
// The library may still read them, by code that is not kept up.
TEST(Compress, ZstdRefusesFramesOfOldVersions) {
  // Of version 0.7: "hello" in one block that is not compressed, and the end.
  Bytes frame{0x27, 0xb5, 0x2f, 0xfd, 0x20, 5, 0x40, 0, 5, 'h', 'e', 'l', 'l', 'o', 0xc0, 0, 0};
  EXPECT_FALSE(decompress(frame, Codec::kZstd, 5).ok());
  frame[0] = 0x26;
  EXPECT_FALSE(decompress(frame, Codec::kZstd, 5).ok());
}

TEST(Compress, AnnouncedSizeThatTheBodyCannotReachIsRefusedBeforeAllocation) {
  const Bytes zstd{0x28, 0xb5, 0x2f, 0xfd, 0xa0, 0xff, 0xff, 0xff, 0xff, 0x01, 0, 0, 0};
  EXPECT_EQ(code_of(decompress(zstd, Codec::kZstd, 0xffffffff)), CloseCode::kMalformed);
  EXPECT_EQ(code_of(decompress(Bytes{0xff, 0xff}, Codec::kLz4, 0x7e000000)), CloseCode::kMalformed);
}

TEST(Compress, TheMostThatABodyCanGrowIsRead) {
  const Bytes zeros(10'000'000, 0);
  for (const auto how : {kLz4, kZstd, Compression{Codec::kZstd, 19}}) {
    const Bytes body = compress(zeros, how).value();
    EXPECT_EQ(decompress(body, how.codec, zeros.size()).value(), zeros);
  }
}

TEST(Compress, DamagedBodiesNeverYieldAnotherSize) {
  const Bytes raw = steps(2000);
  std::mt19937 random{2};
  for (const auto how : {kLz4, kZstd}) {
    const Bytes body = compress(raw, how).value();
    for (int i = 0; i < 2000; ++i) {
      Bytes damaged = body;
      damaged[random() % damaged.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
      const auto out = decompress(damaged, how.codec, raw.size());
      EXPECT_TRUE(!out.ok() || out.value().size() == raw.size());
    }
  }
}

}  // namespace
}  // namespace connect_bridge
