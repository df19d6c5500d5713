// What rules and `accepts` say of what is exported.
#include "core/offers/export_right.hpp"

#include <gtest/gtest.h>

#include "unit/topics/one_link.hpp"

namespace connect_bridge::topics_test {
namespace {

using Answer = ExportRight::Answer;

struct Rights : Actions {
  explicit Rights(std::vector<Rule> rules = {everything()}) { policy = Policy(std::move(rules)); }

  Answer answer(const std::string& name, const std::string& type = kType,
                InterfaceKind kind = InterfaceKind::kTopic) {
    return export_right(side, peer.link, LocalInterface{kind, {name, type}}).answer;
  }

  OneLink peer;
};

TEST(ExportRight, NeedsBothSides) {
  Rights s({rule({"/a", "/b"}, {})});
  s.peer.link.accepts.adopt(Accepts{{{{"/b", "/c"}, {}}}, {}});
  EXPECT_EQ(s.answer("/a"), Answer::kNotAccepted);
  EXPECT_EQ(s.answer("/b"), Answer::kYes);
  EXPECT_EQ(s.answer("/c"), Answer::kForbidden);
}

TEST(ExportRight, BeforeThePeerHasToldOurRulesAreKnown) {
  Rights s({rule({"/a"}, {})});
  s.peer.link.accepts.lost();
  EXPECT_EQ(s.answer("/a"), Answer::kUnknown);
  EXPECT_EQ(s.answer("/b"), Answer::kForbidden);
}

TEST(ExportRight, HasTheDecisionOfOurRulesAlsoWhereThePeerDoesNotTakeIt) {
  Rule treated = rule({"/a"}, {});
  treated.treatment.max_rate = 7;
  Rights s({treated});
  s.peer.link.accepts.adopt(Accepts{});
  const auto right =
      export_right(s.side, s.peer.link, LocalInterface{InterfaceKind::kTopic, {"/a", kType}});
  EXPECT_TRUE(right.is_allowed_here());
  EXPECT_EQ(right.decision.treatment.max_rate, 7);
}

TEST(ExportRight, OfAnActionThatIsNotWholeNobodyHasAPart) {
  Rights s;
  EXPECT_EQ(s.answer("/fib/_action/feedback", "p/action/Fib_FeedbackMessage"), Answer::kNotWhole);
}

TEST(ExportRight, WhatIsOutsideThePrefixIsForNobody) {
  Rights s;
  s.peer.link.names = NameMap("/robot", {});
  EXPECT_EQ(s.answer("/a"), Answer::kForbidden);
  EXPECT_EQ(s.answer("/robot/a"), Answer::kYes);
}

TEST(ExportRight, ParameterEventsAreForWhoTakesTheParametersOfSomeNode) {
  Rule opening = rule({}, {});
  opening.opens[Direction::kExport][OpenedBy::kParameters] = {Pattern::parse("/talker").value()};
  Rights s({opening});
  const auto events = [&] { return s.answer("/parameter_events", kParameterEventType.data()); };
  EXPECT_EQ(events(), Answer::kYes);
  EXPECT_TRUE(may_have_events(s.side, s.peer.link, "/talker"));
  EXPECT_FALSE(may_have_events(s.side, s.peer.link, "/listener"));
  s.peer.link.accepts.adopt(Accepts{{{{"/**"}, {}}}, {}});
  EXPECT_EQ(events(), Answer::kNotAccepted);
  EXPECT_FALSE(may_have_events(s.side, s.peer.link, "/talker"));
}

}  // namespace
}  // namespace connect_bridge::topics_test
