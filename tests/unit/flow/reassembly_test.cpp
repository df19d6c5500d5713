#include "core/flow/reassembly.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace connect_bridge {
namespace {

constexpr ChannelId kFirst{1};
constexpr ChannelId kSecond{2};

ReassemblyOptions small() {
  ReassemblyOptions options;
  options.message_bytes_max = 100;
  options.open_bytes_max = 150;
  return options;
}

// The result of a frame: "whole 5", "open", or the name of the close code.
std::string outcome_of(const Result<std::optional<InMessage>>& result) {
  if (!result) return std::string(name_of(result.error().code));
  if (!result.value()) return "open";
  return "whole " + std::to_string(result.value()->body.size());
}

class ReassemblyTest : public ::testing::Test {
 protected:
  // A message frame with `part` bytes of `body`.
  std::string begin(ChannelId channel, std::uint32_t sequence, std::uint32_t part,
                    std::uint32_t body) {
    return outcome_of(on_message(frame(channel, sequence, part, body)));
  }
  std::string go_on(ChannelId channel, std::uint32_t part) {
    return outcome_of(on_part({channel, false, packet_.view().first(part)}));
  }
  std::string abort(ChannelId channel) { return outcome_of(on_part({channel, true, {}})); }
  Result<std::optional<InMessage>> on_message(const MessageFrame& frame, bool keep = true) {
    return reassembly_.on_message(streams_[frame.channel], frame, packet_, keep);
  }
  Result<std::optional<InMessage>> on_part(const PartFrame& frame) {
    return reassembly_.on_part(streams_[frame.channel], frame);
  }
  MessageFrame frame(ChannelId channel, std::uint32_t sequence, std::uint32_t part,
                     std::uint32_t body) const {
    MessageFrame frame;
    frame.channel = channel;
    frame.subject = OriginId{3};
    frame.sequence = sequence;
    frame.demand = 5;
    frame.stamp = 4;
    frame.number = 6;
    frame.raw_bytes = frame.body_bytes = body;
    frame.part = packet_.view().first(part);
    return frame;
  }

  Payload packet_ = Payload::adopt(Bytes(1000, 0xAB));
  Reassembly reassembly_{small()};
  std::map<ChannelId, Reassembly::Stream> streams_;
};

// A peer without any right may offer channels and begin messages on them.
TEST_F(ReassemblyTest, WhatIsNotWantedIsCheckedButNotKept) {
  const auto begun = on_message(frame(kFirst, 1, 5, 20), false);
  EXPECT_EQ(outcome_of(begun), "open");
  EXPECT_EQ(reassembly_.open_bytes(), 0U);
  EXPECT_EQ(go_on(kFirst, 16), "malformed");
  EXPECT_EQ(go_on(kFirst, 14), "open");
  EXPECT_EQ(go_on(kFirst, 1), "whole 0");
  EXPECT_EQ(reassembly_.open_bytes(), 0U);
}

TEST_F(ReassemblyTest, AWholeMessageIsASliceOfItsPacket) {
  auto sent = frame(kFirst, 1, 0, 10);
  sent.part = packet_.view().subspan(20, 10);
  const auto result = on_message(sent);
  ASSERT_TRUE(result.ok() && result.value());
  EXPECT_EQ(result.value()->body.view().data(), packet_.view().data() + 20);
  EXPECT_EQ(result.value()->body.size(), 10U);
  EXPECT_EQ(result.value()->subject, OriginId{3});
  EXPECT_EQ(result.value()->demand, 5U);
  EXPECT_EQ(result.value()->stamp, 4);
  EXPECT_EQ(result.value()->number, 6U);
  EXPECT_EQ(reassembly_.open_bytes(), 0U);
}

TEST_F(ReassemblyTest, PartsOfTwoChannelsInterleave) {
  EXPECT_EQ(begin(kFirst, 1, 40, 100), "open");
  EXPECT_EQ(begin(kSecond, 1, 10, 50), "open");
  EXPECT_EQ(reassembly_.open_bytes(), 150U);
  EXPECT_EQ(go_on(kFirst, 40), "open");
  EXPECT_EQ(go_on(kSecond, 40), "whole 50");
  EXPECT_EQ(go_on(kFirst, 20), "whole 100");
  EXPECT_EQ(reassembly_.open_bytes(), 0U);
  EXPECT_EQ(begin(kFirst, 2, 5, 5), "whole 5");
  EXPECT_EQ(begin(kSecond, 2, 0, 0), "whole 0");
}

TEST_F(ReassemblyTest, SizesAreCheckedBeforeAnythingIsKept) {
  EXPECT_EQ(begin(kFirst, 1, 1, 101), "too_large");
  EXPECT_EQ(begin(kFirst, 1, 1, 0xFFFFFFFF), "too_large");
  auto bomb = frame(kFirst, 1, 10, 10);
  bomb.codec = Codec::kZstd;
  bomb.raw_bytes = 101;
  EXPECT_EQ(outcome_of(on_message(bomb)), "too_large");
  bomb.raw_bytes = 100;
  EXPECT_EQ(outcome_of(on_message(bomb)), "whole 10");
  EXPECT_EQ(begin(kSecond, 1, 20, 10), "malformed");
  EXPECT_EQ(begin(kSecond, 1, 0, 10), "malformed");
  auto two_sizes = frame(kSecond, 1, 10, 10);
  two_sizes.raw_bytes = 11;
  EXPECT_EQ(outcome_of(on_message(two_sizes)), "malformed");
  EXPECT_EQ(reassembly_.open_bytes(), 0U);
}

TEST_F(ReassemblyTest, TheBudgetOfAllUnfinishedMessagesIsExact) {
  EXPECT_EQ(begin(kFirst, 1, 1, 100), "open");
  EXPECT_EQ(begin(kSecond, 1, 1, 51), "too_large");
  EXPECT_EQ(begin(kSecond, 1, 1, 50), "open");
  EXPECT_EQ(begin(ChannelId{3}, 1, 1, 2), "too_large");
  EXPECT_EQ(begin(ChannelId{3}, 1, 100, 100), "whole 100");  // whole messages need no room
  EXPECT_EQ(abort(kFirst), "open");
  EXPECT_EQ(reassembly_.open_bytes(), 50U);
  EXPECT_EQ(begin(kFirst, 2, 1, 100), "open");
}

TEST_F(ReassemblyTest, PartsMustBelongToAnOpenMessage) {
  EXPECT_EQ(go_on(kFirst, 1), "illegal");
  EXPECT_EQ(abort(kFirst), "illegal");
  EXPECT_EQ(begin(kFirst, 1, 5, 5), "whole 5");
  EXPECT_EQ(go_on(kFirst, 1), "illegal");
  EXPECT_EQ(begin(kFirst, 2, 5, 10), "open");
  EXPECT_EQ(go_on(kFirst, 6), "malformed");
  EXPECT_EQ(go_on(kFirst, 0), "malformed");
  EXPECT_EQ(begin(kFirst, 3, 1, 10), "illegal");
  EXPECT_EQ(go_on(kFirst, 5), "whole 10");
  EXPECT_EQ(abort(kFirst), "illegal");
}

TEST_F(ReassemblyTest, SequencesRiseAndGoFromTheLargestToOne) {
  EXPECT_EQ(begin(kFirst, 0, 1, 1), "illegal");
  EXPECT_EQ(begin(kFirst, 1, 1, 1), "whole 1");
  EXPECT_EQ(begin(kFirst, 1, 1, 1), "illegal");
  EXPECT_EQ(begin(kFirst, 5, 1, 1), "whole 1");
  EXPECT_EQ(begin(kFirst, 4, 1, 1), "illegal");
  EXPECT_EQ(begin(kSecond, 1, 1, 1), "whole 1");
  for (const std::uint32_t next : {0x70000000U, 0xE0000000U, 0xFFFFFFFFU}) {
    EXPECT_EQ(begin(kFirst, next, 1, 1), "whole 1") << next;
  }
  EXPECT_EQ(begin(kFirst, 0, 1, 1), "illegal");
  for (const std::uint32_t next : {1U, 2U}) {
    EXPECT_EQ(begin(kFirst, next, 1, 1), "whole 1") << next;
  }
  EXPECT_EQ(begin(kFirst, 0xFFFFFFFF, 1, 1), "illegal");
}

TEST_F(ReassemblyTest, AnAbortedMessageLeavesRoomForTheNext) {
  EXPECT_EQ(begin(kFirst, 1, 5, 10), "open");
  EXPECT_EQ(abort(kFirst), "open");
  EXPECT_EQ(reassembly_.open_bytes(), 0U);
  EXPECT_EQ(begin(kFirst, 1, 1, 1), "illegal");  // its number is used up
  EXPECT_EQ(begin(kFirst, 2, 1, 1), "whole 1");
}

TEST_F(ReassemblyTest, AForgottenChannelIsAsNew) {
  EXPECT_EQ(begin(kFirst, 9, 5, 10), "open");
  streams_.erase(kFirst);
  EXPECT_EQ(reassembly_.open_bytes(), 0U);
  EXPECT_EQ(go_on(kFirst, 5), "illegal");
  EXPECT_EQ(begin(kFirst, 1, 1, 1), "whole 1");
}

TEST_F(ReassemblyTest, NoSequenceOfFramesBreaksTheBudget) {
  std::mt19937_64 random(20);
  const auto pick = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
  for (int i = 0; i < 50'000; ++i) {
    const ChannelId channel{1 + pick(5)};
    switch (pick(8)) {
      case 0: abort(channel); break;
      case 1: streams_.erase(channel); break;
      case 2:
      case 3: {
        const auto body = pick(120);
        begin(channel, 1 + pick(1000), pick(body + 3), body);
        break;
      }
      default: go_on(channel, pick(60)); break;
    }
    ASSERT_LE(reassembly_.open_bytes(), small().open_bytes_max);
  }
  streams_.clear();
  EXPECT_EQ(reassembly_.open_bytes(), 0U);
}

// A message without memory is checked like any other, and arrives without its body; later ones get
// the memory that others have given back.
TEST_F(ReassemblyTest, WhatFindsNoMemoryArrivesWithoutItsBody) {
  Budget memory(200);
  auto others = memory.hold(150);
  reassembly_.draw_from(memory);
  EXPECT_EQ(begin(kFirst, 1, 20, 60), "open");
  EXPECT_EQ(memory.used(), 150U);
  EXPECT_EQ(go_on(kFirst, 41), "malformed");
  const auto whole = on_part({kFirst, false, packet_.view().first(40)});
  ASSERT_TRUE(whole.ok() && whole.value());
  EXPECT_FALSE(whole.value()->kept);
  EXPECT_TRUE(whole.value()->body.empty());
  others.release();
  EXPECT_EQ(begin(kFirst, 2, 20, 60), "open");
  EXPECT_EQ(memory.used(), 60U);
  EXPECT_EQ(go_on(kFirst, 40), "whole 60");
  EXPECT_EQ(memory.used(), 0U);
}

}  // namespace
}  // namespace connect_bridge
