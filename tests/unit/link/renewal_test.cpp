// What a client logs in with, and when an open link is told of another credential.
#include "core/link/renewal.hpp"

#include <gtest/gtest.h>

#include <string>
#include <variant>

#include "core/wire/login.hpp"
#include "unit/link/script.hpp"
#include "unit/topics/one_link.hpp"

namespace connect_bridge::link_test {
namespace {

Bytes credential(const std::string& text) {
  return {text.begin(), text.end()};
}

// A link that was dialed with the first credential and is open.
struct Renewing {
  Renewing() {
    subject.on_dialed();
    subject.on_open(link);
  }

  void change(const std::string& to, const std::string& method = "") {
    subject.change({credential(to), method}, &link);
  }
  // The link is lost and open again.
  void reconnect(bool dialed_before_it_changed = false) {
    one.lose();
    if (!dialed_before_it_changed) subject.on_dialed();
    one.connect();
    subject.on_open(link);
  }
  std::string said() { return one.said(); }
  // The levels of the lines in the log: "info", "warn".
  std::string logged() {
    std::string words;
    while (const auto action = outputs.next())
      if (const auto* log = std::get_if<Log>(&*action))
        words += log->level == LogLevel::kInfo ? "info" : "warn";
    return words;
  }

  topics_test::OneLink one;
  Link& link = one.link;
  Outputs outputs;
  Renewal subject{"token", credential("first"), outputs};
};

TEST(Renewal, AnOpenLinkIsToldAtOnce) {
  Renewing s;
  EXPECT_EQ(s.said(), "");
  s.change("second");
  EXPECT_EQ(s.said(), "renew token second\n");
  EXPECT_EQ(s.subject.credential(), credential("second"));
  s.subject.on_renewed(s.link, true);
  EXPECT_EQ(s.logged(), "info");
  EXPECT_EQ(s.said(), "");
}

TEST(Renewal, TheCredentialEntersNoHistoryOfTexts) {
  Renewing s;
  ConnectionOptions compressing = options(false);
  compressing.outbox.compressed_texts_min = 1;
  s.one.lose();
  s.one.connect(compressing);
  const std::string text(500, 'x');
  s.link.send(text);
  s.change("second");
  s.link.send(text);
  std::size_t plain = 0;
  while (const auto packet = s.link.connection()->next_packet(now_ms(0))) plain += packet->text;
  EXPECT_EQ(plain, 1U);
  EXPECT_EQ(s.link.outbox().texts().texts().size(), 2 * text.size());
}

TEST(Renewal, TheMethodStaysUnlessAnotherOneComes) {
  Renewing s;
  s.change("second", "jwt");
  EXPECT_EQ(s.said(), "renew jwt second\n");
  s.subject.on_renewed(s.link, true);
  s.change("third");
  EXPECT_EQ(s.said(), "renew jwt third\n");
  EXPECT_EQ(s.subject.method(), "jwt");
}

TEST(Renewal, TheServerLooksAtOneAfterTheOther) {
  Renewing s;
  s.change("second");
  s.change("third");
  s.change("fourth");
  EXPECT_EQ(s.said(), "renew token second\n");
  s.subject.on_renewed(s.link, true);
  EXPECT_EQ(s.said(), "renew token fourth\n");
  s.subject.on_renewed(s.link, true);
  EXPECT_EQ(s.said(), "");
}

TEST(Renewal, AfterARefusalTheNextOneIsTriedAllTheSame) {
  Renewing s;
  s.change("wrong");
  s.change("right");
  s.said();
  s.subject.on_renewed(s.link, false);
  EXPECT_EQ(s.logged(), "warn");
  EXPECT_EQ(s.said(), "renew token right\n");
  s.subject.on_renewed(s.link, true);
  EXPECT_EQ(s.logged(), "info");
}

// A server that answers what nobody asked neither fills the log nor makes the client say anything.
TEST(Renewal, AnAnswerToNothingMeansNothing) {
  Renewing s;
  s.subject.on_renewed(s.link, true);
  s.subject.on_renewed(s.link, false);
  EXPECT_EQ(s.logged(), "");
  s.change("second");
  s.change("third");
  s.subject.on_renewed(s.link, true);
  s.subject.on_renewed(s.link, true);
  s.subject.on_renewed(s.link, false);
  EXPECT_EQ(s.logged(), "infoinfo");
  EXPECT_EQ(s.said(), "renew token second\nrenew token third\n");
}

TEST(Renewal, WhatChangesWhileItIsDialedIsToldWhenItIsOpen) {
  Renewing s;
  s.subject.change({credential("second"), ""}, nullptr);
  EXPECT_EQ(s.said(), "");
  s.reconnect(true);
  EXPECT_EQ(s.said(), "renew token second\n");
}

TEST(Renewal, WhatItWasDialedWithIsNotTold) {
  Renewing s;
  s.subject.change({credential("second"), ""}, nullptr);
  s.reconnect();
  EXPECT_EQ(s.said(), "");
}

TEST(Renewal, ALinkThatIsNotOpenIsNotTold) {
  Renewing s;
  s.link.connection()->close();
  s.change("second");
  EXPECT_FALSE(s.link.login.renewing());
  s.one.lose();
  s.change("third");
  EXPECT_FALSE(s.link.login.renewing());
  EXPECT_EQ(s.subject.credential(), credential("third"));
}

// The new connection was dialed with what had waited.
TEST(Renewal, WhatWaitedForAnAnswerOfALostConnectionIsNotToldAgain) {
  Renewing s;
  s.change("second");
  s.change("third");
  s.said();
  s.reconnect();
  s.change("fourth");
  EXPECT_EQ(s.said(), "renew token fourth\n");
  s.subject.on_renewed(s.link, true);
  EXPECT_EQ(s.said(), "");
}

// The server would end the link for a message that is none.
TEST(Renewal, WhatATextCannotCarryIsShownAtTheNextDialOnly) {
  for (const char odd : {' ', '\n', '\x1f', '\x7f', '\x80', '\0'}) {
    Renewing s;
    const std::string text = std::string("with") + odd;
    s.change(text);
    EXPECT_EQ(s.said(), "") << int{odd};
    EXPECT_FALSE(s.link.login.renewing());
    EXPECT_EQ(s.subject.credential(), credential(text));
    s.change("printable");
    EXPECT_EQ(s.said(), "renew token printable\n");
  }
  Renewing s;
  s.change("!~");
  EXPECT_EQ(s.said(), "renew token !~\n");
}

TEST(Renewal, WhatIsLongerThanALoginMayBeIsNotTold) {
  Renewing s;
  s.change(std::string(kCredentialBytesMax + 1, 'x'));
  EXPECT_EQ(s.said(), "");
  s.change(std::string(kCredentialBytesMax, 'x'));
  EXPECT_NE(s.said(), "");
}

}  // namespace
}  // namespace connect_bridge::link_test
