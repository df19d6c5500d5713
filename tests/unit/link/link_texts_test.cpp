// Control texts of a link over its connections.
#include <gtest/gtest.h>

#include <string>

#include "core/compress/compress.hpp"
#include "unit/link/script.hpp"
#include "unit/topics/one_link.hpp"

namespace connect_bridge::link_test {
namespace {

const std::string kNothingEnds = R"({"type":"withdraw","channels":[]})";
const std::string kRoundEnds = R"({"type":"offer","channels":[],"complete":true})";

Bytes raw_of(const std::string& text) {
  return {text.begin(), text.end()};
}

std::string a_round() {
  std::string texts;
  for (int i = 0; i < 5; ++i) texts += kNothingEnds + "\n";
  return texts + kRoundEnds;
}

struct LinkOfTexts {
  LinkOfTexts() { reconnect(); }

  void reconnect() {
    ConnectionOptions compressing = options(false);
    compressing.outbox.compressed_texts_min = 1;
    one.lose();
    one.connect(compressing);
  }
  void send(std::size_t bytes, bool completes = false) {
    link.send(std::string(bytes, 'x'), completes);
    while (link.connection()->next_packet(now_ms(0))) {
    }
  }
  void name(const Bytes& texts) {
    Accepts accepts;
    accepts.base = digest_of(texts);
    Control control = accepts;
    EXPECT_TRUE(link.on_control(control, now_ms(0)));
  }
  void hear(const std::string& texts, const Bytes& base = {}, bool kept = false) {
    const Bytes raw = raw_of(texts);
    const auto body = compress_delta(raw, base, 3).value();
    const TextsFrame frame{kept, static_cast<std::uint32_t>(raw.size()), body};
    link.connection()->on_packet(false, Payload::copy_of(bytes_of(frame, body)), now_ms(0));
  }
  [[nodiscard]] const Bytes& history() const { return link.outbox().texts().texts(); }

  topics_test::OneLink one{1, std::make_shared<Account>(), std::chrono::minutes(1)};
  Link& link = one.link;
};

// To hash and to copy 256 KiB for each `accepts` would hold the loop.
TEST(LinkTexts, OnlyTheFirstAcceptsOfAConnectionNamesABase) {
  LinkOfTexts s;
  s.send(1000, true);
  const Bytes kept = s.history();
  ASSERT_EQ(kept.size(), 1000U);
  s.reconnect();
  s.name(kept);
  EXPECT_EQ(s.history(), kept);
  s.send(500);
  EXPECT_EQ(s.history().size(), 1500U);
  for (int i = 0; i < 100; ++i) s.name(kept);
  EXPECT_EQ(s.history().size(), 1500U);
  s.reconnect();
  s.name({});
  s.name(kept);
  EXPECT_TRUE(s.history().empty());
}

TEST(LinkTexts, AConnectionWithoutACopyLeavesTheOneBefore) {
  LinkOfTexts s;
  s.send(1000, true);
  const Bytes kept = s.history();
  s.reconnect();
  s.send(500);
  s.reconnect();
  s.name(kept);
  EXPECT_EQ(s.history(), kept);
}

// Samples are dropped when they grow too much; texts would end the connection.
TEST(LinkTexts, SamplesThatGrowMuchDoNotEndTheConnection) {
  LinkOfTexts s;
  const std::string round = a_round();
  s.hear(round);
  s.reconnect();
  while (s.link.account->may_inflate(2 << 20, 2000, now_ms(0).steady)) {
  }
  s.hear(round, raw_of(round), true);
  EXPECT_TRUE(s.link.open());
  EXPECT_EQ(s.link.connection()->texts().texts(), raw_of(round + round));
}

TEST(LinkTexts, AsManyAsMayWaitComeAtOnceThenFourMebibytesASecond) {
  LinkOfTexts s;
  const auto frames = [&](std::int64_t at) {
    int count = 0;
    while (count < 2000 && s.link.may_read_texts(kTextsRawMax, now_ms(at))) ++count;
    return count;
  };
  EXPECT_NEAR(frames(0), 1024, 1);
  EXPECT_NEAR(frames(1000), 128, 1);
  s.reconnect();
  EXPECT_EQ(frames(1000), 0);
  EXPECT_NEAR(frames(60'000), 1024, 1);
}

TEST(LinkTexts, AllCopiesCountAsMemory) {
  LinkOfTexts s;
  const std::uint64_t before = s.link.memory.used();
  const std::string round = a_round();
  s.hear(round);
  EXPECT_EQ(s.link.memory.used(), before + 2 * round.size());  // the history, and its copy
  s.reconnect();
  EXPECT_EQ(s.link.memory.used(), before + 2 * round.size());  // the copy, and what may be named
  s.hear(kNothingEnds, raw_of(round), true);
  const std::uint64_t history = round.size() + kNothingEnds.size();
  EXPECT_EQ(s.link.memory.used(), before + round.size() + history);
  s.link.connection()->on_packet(true, Payload::adopt(raw_of(kRoundEnds)), now_ms(0));
  const std::uint64_t copy = kNothingEnds.size();  // of this connection's own texts
  EXPECT_EQ(s.link.memory.used(), before + round.size() + history + copy);
}

}  // namespace
}  // namespace connect_bridge::link_test
