// Control texts that leave compressed, and urgent data beside them.
#include <limits>
#include <string>
#include <vector>

#include "core/base/hex.hpp"
#include "core/base/sha256.hpp"
#include "core/compress/compress.hpp"
#include "unit/flow/script.hpp"

namespace connect_bridge::flow_test {
namespace {

// What a peer reads: each text, and the sizes of the frames that brought them.
struct TextPeer {
  void read(Outbox& outbox) {
    while (const auto packet = outbox.next(now_ms(0))) {
      const Bytes bytes = joined(*packet);
      if (packet->text) {
        texts.emplace_back(bytes.begin(), bytes.end());
        continue;
      }
      FrameReader reader(bytes);
      const auto frame = reader.next();
      ASSERT_TRUE(frame && frame.value());
      const auto* of_texts = std::get_if<TextsFrame>(&*frame.value());
      ASSERT_TRUE(of_texts);
      if (of_texts->kept) history.go_on(kept);
      const auto raw = decompress_delta(of_texts->body, history.texts(), of_texts->raw_bytes);
      ASSERT_TRUE(raw) << "frame " << frames.size();
      history.add(raw.value());
      frames.push_back(bytes.size());
      std::string text;
      for (const auto byte : raw.value()) {
        if (byte != '\n') text += static_cast<char>(byte);
        if (byte == '\n') texts.push_back(std::exchange(text, {}));
      }
      texts.push_back(text);
    }
  }

  TextHistory history;
  Bytes kept;
  std::vector<std::string> texts;
  std::vector<std::size_t> frames;
};

// Each has an id that no other text tells.
std::vector<std::string> offers(std::size_t count, std::size_t from = 0) {
  std::vector<std::string> texts;
  for (std::size_t i = from; i < from + count; ++i) {
    const std::string name = "/robot/arm/joint_" + std::to_string(i * 7) + "/state";
    const Digest id = sha256(Bytes(name.begin(), name.end()));
    texts.push_back(R"({"type":"offer","channels":[{"channel":)" + std::to_string(i) +
                    R"(,"kind":"topic","name":")" + name +
                    R"(","type":"sensor_msgs/msg/JointState","origins":[{"origin":1,"gid":")" +
                    to_hex({id.data(), 24}) + R"("}]}]})");
  }
  return texts;
}

void push(Outbox& outbox, const std::vector<std::string>& texts) {
  for (const auto& text : texts) ASSERT_TRUE(outbox.push_control({text}));
}

TEST(OutboxTexts, ManyLeaveTogetherAndMuchSmaller) {
  Outbox outbox(OutboxOptions{});
  const auto texts = offers(60);
  push(outbox, texts);
  TextPeer peer;
  peer.read(outbox);
  EXPECT_EQ(peer.texts, texts);
  ASSERT_EQ(peer.frames.size(), 1U);
  EXPECT_LT(peer.frames[0] * 4, texts.size() * texts[0].size());
  // They count as bytes of a packet, which the peer acknowledges.
  EXPECT_EQ(outbox.unacknowledged_bytes(), peer.frames[0]);
  EXPECT_TRUE(outbox.acknowledge({peer.frames[0], 1}, now_ms(1)));
  EXPECT_FALSE(outbox.acknowledge({peer.frames[0] + 1, 1}, now_ms(1)));
}

TEST(OutboxTexts, WhatFollowsRefersToThoseBefore) {
  Outbox outbox(OutboxOptions{});
  push(outbox, offers(20));
  TextPeer peer;
  peer.read(outbox);
  push(outbox, offers(20));
  peer.read(outbox);
  ASSERT_EQ(peer.frames.size(), 2U);
  EXPECT_LT(peer.frames[1] * 3, peer.frames[0]);
}

TEST(OutboxTexts, FewBytesAndLongTextsLeaveInPlain) {
  Outbox outbox(OutboxOptions{});
  std::vector<std::string> texts = offers(2);
  texts.emplace_back(kTextsRawMax + 1, 'x');
  texts.emplace_back("{}");
  push(outbox, texts);
  TextPeer peer;
  peer.read(outbox);
  EXPECT_EQ(peer.texts, texts);
  EXPECT_TRUE(peer.frames.empty());
}

// The credential of a renewal.
TEST(OutboxTexts, APlainTextEntersNoHistory) {
  Outbox outbox(OutboxOptions{});
  std::vector<std::string> texts = offers(60);
  for (std::size_t i = 0; i < texts.size(); ++i)
    ASSERT_TRUE(outbox.push_control({texts[i], false, i == 0 || i == 30}));
  TextPeer peer;
  peer.read(outbox);
  EXPECT_EQ(peer.texts, texts);
  EXPECT_EQ(peer.frames.size(), 2U);
  const Bytes& history = outbox.texts().texts();
  const std::string kept(history.begin(), history.end());
  EXPECT_EQ(kept.find(texts[0]), std::string::npos);
  EXPECT_EQ(kept.find(texts[30]), std::string::npos);
  EXPECT_NE(kept.find(texts[31]), std::string::npos);
}

TEST(OutboxTexts, NoMoreThanAFrameMayHold) {
  Outbox outbox(OutboxOptions{});
  const auto texts = offers(3 * kTextsMax);
  push(outbox, texts);
  TextPeer peer;
  peer.read(outbox);
  EXPECT_EQ(peer.texts, texts);
  EXPECT_EQ(peer.frames.size(), 3U);
}

// Both sides forget the same: what is older than the limit.
TEST(OutboxTexts, TheHistoryIsBounded) {
  Outbox outbox(OutboxOptions{});
  TextPeer peer;
  for (std::size_t i = 0; i < 60; ++i) {
    push(outbox, offers(60, 60 * i));
    peer.read(outbox);
  }
  EXPECT_EQ(peer.texts.size(), 3600U);
  EXPECT_EQ(outbox.texts().texts().size(), TextHistory::kBytesMax);
  EXPECT_EQ(outbox.texts().texts(), peer.history.texts());
  // The compressor would index all of it for a few short texts.
  const auto frames = peer.frames.size();
  push(outbox, offers(4, 3600));
  peer.read(outbox);
  EXPECT_EQ(peer.frames.size(), frames);
  EXPECT_EQ(peer.texts.size(), 3604U);
  push(outbox, offers(12, 3604));
  peer.read(outbox);
  EXPECT_EQ(peer.frames.size(), frames + 1);
}

// A reconnect costs what has changed: the same first round again is some bytes.
TEST(OutboxTexts, AnotherConnectionContinuesWithWhatThePeerKeeps) {
  const auto texts = offers(600);
  Outbox first(OutboxOptions{});
  TextPeer peer;
  push(first, texts);
  ASSERT_TRUE(first.push_control({"{\"complete\":true}", true}));
  peer.read(first);
  const Bytes history = peer.history.texts();
  push(first, offers(20, 5000));  // later ones are not kept
  peer.read(first);
  const Bytes kept = first.texts().kept();
  EXPECT_EQ(kept, history);
  EXPECT_NE(digest_of(kept), digest_of(first.texts().texts()));
  std::size_t before = 0;
  for (const auto bytes : peer.frames) before += bytes;

  Outbox second(OutboxOptions{});
  second.go_on_with(kept);
  push(second, texts);
  TextPeer again;
  again.kept = kept;
  again.read(second);
  EXPECT_EQ(again.texts, texts);
  std::size_t after = 0;
  for (const auto bytes : again.frames) after += bytes;
  EXPECT_LT(after * 5, before);
}

// ---- urgent data

Outbox with_texts(const std::vector<ChannelId>& urgent) {
  OutboxOptions options = one_by_one();
  options.compressed_texts_min = std::numeric_limits<std::size_t>::max();
  Outbox outbox(options);
  for (const ChannelId channel : urgent) outbox.add_channel(channel, queue(Priority::kUrgent));
  return outbox;
}

TEST(OutboxTexts, UrgentDataAndTextsTakeTurns) {
  Outbox outbox = with_texts({kA});
  outbox.add_channel(kB, queue(Priority::kHigh));
  push(outbox, {"{1}", "{2}", "{3}"});
  outbox.push(kB, message(9), now_ms(0));
  outbox.push(kA, message(10), now_ms(0));
  outbox.push(kA, message(11), now_ms(0));
  EXPECT_EQ(drain(outbox), "1#1:10\n\"{1}\"\n1#2:11\n\"{2}\"\n\"{3}\"\n2#1:9\n");
}

TEST(OutboxTexts, LightMessagesPassAsUrgentOnesDo) {
  Outbox outbox = with_texts({});
  QueueOptions light = queue(Priority::kNormal);
  light.may_be_light = true;
  outbox.add_channel(kA, light);
  push(outbox, {"{1}"});
  outbox.push(kA, message(10), now_ms(0));
  EXPECT_EQ(drain(outbox), "1#1:10\n\"{1}\"\n");
}

// A new publisher's first message must not come before the publisher.
TEST(OutboxTexts, DataFollowsTheTextsThatNameIt) {
  Outbox outbox = with_texts({kA, kB});
  push(outbox, {"{1}", "origins of 1"});
  outbox.follow_texts(kA);
  push(outbox, {"{3}"});
  outbox.push(kA, message(10), now_ms(0));
  EXPECT_EQ(drain(outbox), "\"{1}\"\n\"origins of 1\"\n1#1:10\n\"{3}\"\n");
  push(outbox, {"{4}", "{5}"});
  outbox.push(kA, message(10), now_ms(0));
  EXPECT_EQ(drain(outbox), "\"{4}\"\n1#2:10\n\"{5}\"\n");
}

// The demand for an action's feedback leaves before the goal.
TEST(OutboxTexts, CallsPassNoText) {
  Outbox outbox = with_texts({});
  QueueOptions calls = queue(Priority::kUrgent);
  calls.keep = true;
  outbox.add_channel(kA, calls);
  push(outbox, {"{1}", "{2}"});
  outbox.push(kA, message(10), now_ms(0));
  EXPECT_EQ(drain(outbox), "\"{1}\"\n\"{2}\"\n1#1:10\n");
}

// Its window is full: the texts leave all the same.
TEST(OutboxTexts, UrgentDataThatMayNotLeaveHoldsUpNoText) {
  OutboxOptions options = one_by_one();
  options.unacknowledged_bytes_max = 200;
  Outbox outbox(options);
  outbox.add_channel(kA, queue(Priority::kUrgent));
  std::size_t sent = 0;
  for (; sent < 2000; ++sent) {
    outbox.push(kA, message(100), now_ms(0));
    if (!outbox.next(now_ms(0))) break;
  }
  ASSERT_LT(sent, 2000U);
  push(outbox, {"{1}", "{2}"});
  EXPECT_EQ(next(outbox), "\"{1}\"");
  EXPECT_EQ(next(outbox), "\"{2}\"");
}

}  // namespace
}  // namespace connect_bridge::flow_test
