// Control texts that arrive compressed.
#include <gtest/gtest.h>

#include <string>

#include "core/compress/compress.hpp"
#include "core/flow/text_history.hpp"
#include "unit/link/script.hpp"

namespace connect_bridge::link_test {
namespace {

const std::string kWithdraw = R"({"type":"withdraw","channels":[1,2,3,4,5,6,7,8,9]})";

Bytes bytes_of_text(const std::string& text) {
  return {text.begin(), text.end()};
}

Bytes texts_of(const std::string& texts, const Bytes& base = {}, bool kept = false) {
  const Bytes raw = bytes_of_text(texts);
  const auto body = compress_delta(raw, base, 3).value();
  return bytes_of(TextsFrame{kept, static_cast<std::uint32_t>(raw.size()), body}, body);
}

std::string many(std::size_t count) {
  std::string texts = kWithdraw;
  for (std::size_t i = 1; i < count; ++i) texts += "\n" + kWithdraw;
  return texts;
}

TEST(Texts, EachIsRead) {
  auto script = open_client();
  EXPECT_EQ(script.binary(texts_of(many(3))), "control, control, control");
  EXPECT_EQ(script.binary(texts_of(many(2), bytes_of_text(many(3)))), "control, control");
  EXPECT_EQ(script.text(kWithdraw), "control");
  EXPECT_EQ(script.binary(texts_of(many(1), bytes_of_text(many(3) + many(2)))), "control");
}

TEST(Texts, ThoseThatReferToOthersAreRefused) {
  auto script = open_client();
  EXPECT_EQ(script.binary(texts_of(many(3))), "control, control, control");
  const std::string other = R"({"type":"withdraw","channels":[91,82,73,64,55,46,37]})";
  EXPECT_EQ(script.binary(texts_of(other, bytes_of_text(other))), "failed 4002");
}

TEST(Texts, AfterABadOneNoneIsRead) {
  auto script = open_client();
  EXPECT_EQ(script.binary(texts_of(kWithdraw + "\n{}\n" + kWithdraw)), "control, failed 4002");
  auto empty = open_client();
  EXPECT_EQ(empty.binary(texts_of(kWithdraw + "\n" + kWithdraw + "\n")),
            "control, control, failed 4002");
}

TEST(Texts, OneFrameHasNoMoreThanItMay) {
  auto script = open_client();
  std::string most = "control";
  for (std::size_t i = 1; i < kTextsMax; ++i) most += ", control";
  EXPECT_EQ(script.binary(texts_of(many(kTextsMax))), most);
  auto more = open_client();
  EXPECT_EQ(more.binary(texts_of(many(kTextsMax + 1))), most + ", failed 4006");
}

TEST(Texts, TheirBytesAreLimited) {
  auto script = open_client();
  script.reads_texts(false);
  EXPECT_EQ(script.binary(texts_of(many(3))), "failed 4006");
}

TEST(Texts, APacketHasOneFrameOfThem) {
  const Bytes first = texts_of(many(3));
  const Bytes second = texts_of(many(1), bytes_of_text(many(3)));
  auto script = open_client();
  EXPECT_EQ(script.binary(first + second), "control, control, control, failed 4006");
  auto apart = open_client();
  EXPECT_EQ(apart.binary(first), "control, control, control");
  EXPECT_EQ(apart.binary(second), "control");
}

TEST(Texts, ThoseOfAnEarlierConnectionMustHaveBeenNamed) {
  const Bytes kept = bytes_of_text(many(5));
  auto unnamed = open_client();
  EXPECT_EQ(unnamed.binary(texts_of(many(3), kept, true)), "failed 4002");
  auto script = open_client();
  script.link.name_texts(kept);
  EXPECT_EQ(script.binary(texts_of(many(2))), "control, control");
  EXPECT_EQ(script.binary(texts_of(many(1), kept, true)), "control");
  EXPECT_EQ(script.binary(texts_of(many(1), bytes_of_text(many(5) + many(1)))), "control");
}

TEST(Texts, ThoseOfAnEarlierConnectionAreTakenOnce) {
  const Bytes kept = bytes_of_text(many(5));
  auto script = open_client();
  script.link.name_texts(kept);
  EXPECT_EQ(script.binary(texts_of(many(1), kept, true)), "control");
  EXPECT_EQ(script.binary(texts_of(many(1), kept, true)), "failed 4002");
}

TEST(Texts, ACopyIsKeptWhenTheFirstRoundIsComplete) {
  auto script = open_client();
  const std::string complete = R"({"type":"offer","channels":[],"complete":true})";
  script.binary(texts_of(many(2)));
  EXPECT_TRUE(script.link.texts().kept().empty());
  script.binary(texts_of(complete + "\n" + many(1), bytes_of_text(many(2))));
  const Bytes copy = bytes_of_text(many(2) + complete + "\n" + many(1));
  EXPECT_EQ(script.link.texts().kept(), copy);
  EXPECT_EQ(script.text(complete), "control");
  EXPECT_EQ(script.binary(texts_of(many(3), copy)), "control, control, control");
  EXPECT_EQ(script.text(complete), "control");
  EXPECT_EQ(script.link.texts().kept(), copy);
}

}  // namespace
}  // namespace connect_bridge::link_test
