#include "core/graph/actions.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "unit/side/words.hpp"

namespace connect_bridge::side_test {
namespace {

constexpr char kGo[] = "p/action/Go";

// The parts of /go but one, as its server has them; `lacking`: the type of this one is not here.
GraphView go(std::optional<ActionPart> without = {}, std::optional<ActionPart> lacking = {}) {
  GraphChanged graph;
  for (const ActionPart part : kActionParts) {
    if (part == without) continue;
    const std::string name = name_of_part("/go", part);
    std::optional<TypeLack> lack;
    if (part == lacking) lack = TypeLack{"type_unknown", "not here"};
    if (kind_of(part) == InterfaceKind::kService) {
      ServiceState state = service(name);
      state.type = type_of_part(kGo, part);
      state.lack = lack;
      graph.services.push_back(std::move(state));
    } else {
      Topic state = topic(name).pub(1);
      state.type = type_of_part(kGo, part);
      state.lack = lack;
      graph.topics.push_back(std::move(state));
    }
  }
  return GraphView(std::move(graph));
}

std::optional<std::string> type_of(const LocalActions& actions, ActionPart part,
                                   const std::string& type = kGo) {
  return actions.type_of(kind_of(part), name_of_part("/go", part), type_of_part(type, part));
}

struct Local {
  bool see(const GraphView& graph) { return !actions.update(graph, claims).empty(); }
  bool is_whole() const { return type_of(actions, ActionPart::kSendGoal).has_value(); }

  Claims claims{Token128{}};
  LocalActions actions;
};

TEST(LocalActions, OneIsWholeWithAllItsParts) {
  Local s;
  for (const ActionPart part : kActionParts) {
    EXPECT_FALSE(s.see(go(part)));
    EXPECT_FALSE(s.is_whole());
  }
  EXPECT_TRUE(s.see(go()));
  EXPECT_FALSE(s.see(go()));  // nothing new
  for (const ActionPart part : kActionParts) EXPECT_EQ(type_of(s.actions, part), kGo);
  EXPECT_TRUE(s.see(go(ActionPart::kStatus)));
  for (const ActionPart part : kActionParts) EXPECT_FALSE(type_of(s.actions, part));
}

TEST(LocalActions, APartOfAnotherTypeIsNone) {
  Local s;
  s.see(go());
  EXPECT_FALSE(type_of(s.actions, ActionPart::kFeedback, "p/action/Other"));
  EXPECT_FALSE(s.actions.type_of(InterfaceKind::kService, "/go/_action/else", "p/srv/S"));
}

TEST(LocalActions, WhatIsNoPartHasNone) {
  const Local s;
  EXPECT_EQ(s.actions.type_of(InterfaceKind::kTopic, "/go", kType), "");
}

TEST(LocalActions, AReportWithoutAPublisherIsNoPart) {
  const GraphView whole = go();
  GraphChanged graph;
  for (const auto& [key, state] : whole.services()) {
    graph.services.push_back(service(key.first));
    graph.services.back().type = key.second;
  }
  for (const auto& [key, state] : whole.topics()) {
    graph.topics.push_back(topic(key.first).sub(1));
    graph.topics.back().type = key.second;
  }
  Local s;
  EXPECT_FALSE(s.see(GraphView(std::move(graph))));
}

// Its server is elsewhere.
TEST(LocalActions, OneThatAnotherBridgeMirrorsIsNone) {
  Local s;
  s.see(go());
  Claim claim{Token128{{1}}};
  claim.services = {service_gid(name_of_part("/go", ActionPart::kCancelGoal))};
  claim.good_for = std::chrono::seconds(4);
  s.claims.update(gid(9), claim, {});
  EXPECT_TRUE(s.see(go()));
  EXPECT_FALSE(s.is_whole());
}

TEST(LocalActions, OneWhoseTypesAreNotAllHereIsToldAndNotWhole) {
  Local s;
  s.see(go({}, ActionPart::kFeedback));
  EXPECT_FALSE(s.is_whole());
  ASSERT_TRUE(s.actions.lacked().contains("/go"));
  EXPECT_EQ(s.actions.lacked().at("/go").type, kGo);
  EXPECT_EQ(s.actions.lacked().at("/go").lack.reason, "not here");
  s.see(go(ActionPart::kStatus, ActionPart::kFeedback));
  EXPECT_TRUE(s.actions.lacked().empty());  // it would not be whole anyway
}

}  // namespace
}  // namespace connect_bridge::side_test
