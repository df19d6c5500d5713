// Offers that still hold over a break: they are told again, and cost next to nothing.
#include <gtest/gtest.h>

#include <string>

#include "core/base/hex.hpp"
#include "core/compress/compress.hpp"
#include "core/flow/text_history.hpp"
#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

struct Opening {
  bool kept = false;  // a frame referred to what the peer had named
  Bytes history;      // as the peer keeps it
  std::size_t offers = 0;
  std::string texts;
};

struct LargeGraph : Script {
  LargeGraph() : Script(keeping(), false) {
    std::vector<Topic> topics;
    for (std::uint8_t n = 1; n <= 100; ++n)
      topics.push_back(topic("/robot/node_" + std::to_string(n * 37) + "/state").pub(n));
    graph(topics);
    pass(1000);
  }
  // A connection on which the peer names these texts; what it reads then.
  Opening open(std::uint32_t connection, const Bytes& named) {
    session = login(connection, session);
    Accepts accepts{{{{"/**"}, {}}}, {}};
    accepts.base = digest_of(named);
    say(connection, accepts);
    did();
    Opening read;
    TextHistory history;
    const auto note = [&](const std::string& text) {
      read.texts += text + "\n";
      const auto control = decode_control(text);
      ASSERT_TRUE(control) << text;
      const auto* offer = std::get_if<Offer>(&control.value());
      if (!offer) return;
      read.offers += offer->channels.size();
      if (offer->complete) history.keep();
    };
    while (const auto packet = side.next_packet({connection}, flow_test::now_ms(at))) {
      const Bytes bytes = flow_test::joined(*packet);
      if (packet->text) {
        note({bytes.begin(), bytes.end()});
        continue;
      }
      FrameReader reader(bytes);
      while (const auto frame = reader.next().value()) {
        const auto* texts = std::get_if<TextsFrame>(&*frame);
        if (!texts) continue;
        read.kept = read.kept || texts->kept;
        if (texts->kept) history.go_on(named);
        const auto raw = decompress_delta(texts->body, history.texts(), texts->raw_bytes);
        if (!raw) {
          ADD_FAILURE() << "texts of another history";
          return read;
        }
        history.add(raw.value());
        std::string text;
        for (const auto byte : raw.value()) {
          if (byte == '\n')
            note(std::exchange(text, {}));
          else
            text += static_cast<char>(byte);
        }
        note(text);
      }
    }
    read.history = history.kept();
    return read;
  }
  Token128 session;
};

TEST(OffersOnce, AfterABreakTheyReferToThoseBefore) {
  LargeGraph s;
  const Opening first = s.open(1, {});
  EXPECT_EQ(first.offers, 100U);
  EXPECT_FALSE(first.kept);
  s.lose(1);
  const Opening again = s.open(2, first.history);
  EXPECT_TRUE(again.kept);
  EXPECT_EQ(again.offers, 100U);
  s.lose(2);
  const Opening third = s.open(3, again.history);
  EXPECT_TRUE(third.kept);
  EXPECT_EQ(third.offers, 100U);
}

TEST(OffersOnce, AWrongGuessMeansAFullRound) {
  LargeGraph s;
  const Opening first = s.open(1, {});
  s.lose(1);
  Bytes other = first.history;
  other.back() ^= 1;
  const Opening again = s.open(2, other);
  EXPECT_FALSE(again.kept);
  EXPECT_EQ(again.offers, 100U);
}

TEST(OffersOnce, NothingIsKeptBeyondTheTimeForAReturn) {
  LargeGraph s;
  const Opening first = s.open(1, {});
  s.lose(1);
  s.pass(61'000);
  const Opening again = s.open(2, first.history);
  EXPECT_FALSE(again.kept);
  EXPECT_EQ(again.offers, 100U);
}

// The importing side: it names what it has read, on the next connection of the link.
TEST(OffersOnce, TheImporterNamesWhatItKeeps) {
  LargeGraph s;
  s.session = s.login(1);
  const std::string round =
      encode(Offer{{channel(1, "/a", {origin(1, 11)})}, false}) + "\n" + encode(Offer{{}, true});
  const Bytes raw(round.begin(), round.end());
  const auto body = compress_delta(raw, {}, 3).value();
  Bytes packet;
  append_header(TextsFrame{false, static_cast<std::uint32_t>(raw.size()), body}, packet);
  packet.insert(packet.end(), body.begin(), body.end());
  s.binary(1, packet);
  s.lose(1);
  const std::string digest = to_hex(digest_of(raw).bytes);
  const Opening again = s.open(2, {});
  EXPECT_NE(again.texts.find("\"base\":\"" + digest + "\""), std::string::npos) << again.texts;
}

}  // namespace
}  // namespace connect_bridge::side_test
