// Actions and parameters of nodes: their parts are offered together, and only a rule for their own
// name allows them.
#include <gtest/gtest.h>

#include "core/base/cdr.hpp"
#include "unit/side/script.hpp"

namespace connect_bridge::side_test {
namespace {

constexpr char kFib[] = "p/action/Fib";
constexpr char kEvents[] = "rcl_interfaces/msg/ParameterEvent";

// The part of an event that is read.
Payload event(const std::string& node) {
  return CdrWriter{}.u32(1).u32(2).string(node).take();
}

ChannelOffer events_of(const std::string& one, const std::string& other) {
  ChannelOffer events = channel(1, "/parameter_events", {origin(1, 5), origin(2, 6)});
  events.type = kEvents;
  events.origins[0].node = one;
  events.origins[1].node = other;
  return events;
}

Rule acting(const std::string& pattern) {
  Rule result = rule({"/**"}, {"/**"});
  result.opens[Direction::kExport][OpenedBy::kServices] =
      result.opens[Direction::kImport][OpenedBy::kServices] = {Pattern::parse("/**").value()};
  result.opens[Direction::kExport][OpenedBy::kActions] =
      result.opens[Direction::kImport][OpenedBy::kActions] = {Pattern::parse(pattern).value()};
  return result;
}
Rule parameters(const std::string& pattern) {
  Rule result = rule({"/**"}, {"/**"});
  result.opens[Direction::kExport][OpenedBy::kServices] =
      result.opens[Direction::kImport][OpenedBy::kServices] = {Pattern::parse("/**").value()};
  result.opens[Direction::kExport][OpenedBy::kParameters] =
      result.opens[Direction::kImport][OpenedBy::kParameters] = {Pattern::parse(pattern).value()};
  return result;
}

ServiceState typed(ServiceState state, const std::string& type) {
  state.type = type;
  return state;
}
Topic typed(Topic topic, const std::string& type) {
  topic.type = type;
  return topic;
}

// The parts of /fib as its server has them; publisher and server n.
std::vector<Topic> topics_of_action(std::uint8_t n) {
  return {typed(topic("/fib/_action/feedback").pub(n), std::string(kFib) + "_FeedbackMessage"),
          typed(topic("/fib/_action/status").pub(static_cast<std::uint8_t>(n + 1), latched()),
                "action_msgs/msg/GoalStatusArray")};
}
std::vector<ServiceState> services_of_action(std::uint8_t n) {
  return {typed(service("/fib/_action/send_goal", {n}), std::string(kFib) + "_SendGoal"),
          typed(service("/fib/_action/cancel_goal", {n}), "action_msgs/srv/CancelGoal"),
          typed(service("/fib/_action/get_result", {n}), std::string(kFib) + "_GetResult")};
}

std::vector<ChannelOffer> offered(Script& s, std::uint32_t connection) {
  std::vector<ChannelOffer> result;
  while (const auto packet = s.side.next_packet({connection}, flow_test::now_ms(s.at))) {
    if (!packet->text) continue;
    const Bytes bytes = flow_test::joined(*packet);
    const auto control =
        decode_control({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    if (const auto* offer = std::get_if<Offer>(&control.value()))
      result.insert(result.end(), offer->channels.begin(), offer->channels.end());
  }
  return result;
}

TEST(SideActions, AnActionIsOfferedWholeOrNotAtAll) {
  Script s(server({acting("/fib")}));
  s.join(1);
  auto services = services_of_action(1);
  services.pop_back();
  s.graph(topics_of_action(2), services);
  EXPECT_EQ(s.said(1), "");
  s.graph({topics_of_action(2)[0]}, services_of_action(1));
  EXPECT_EQ(s.said(1), "");
  s.graph(topics_of_action(2), services_of_action(1));
  const auto parts = offered(s, 1);
  ASSERT_EQ(parts.size(), 5U);
  for (const auto& part : parts) EXPECT_EQ(part.action_type, kFib) << part.name;
  s.graph(topics_of_action(2), services);  // without one of them all go
  const std::string said = s.said(1);
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 5);
  EXPECT_EQ(said.find("offer"), std::string::npos);
}

TEST(SideActions, FeedbackIsSubscribedAsSoonAsGoalsCanCome) {
  Script s(server({acting("/**")}));
  s.join(1);
  s.graph(topics_of_action(2), services_of_action(1));
  std::uint32_t goals = 0;
  for (const auto& part : offered(s, 1))
    if (part.name == "/fib/_action/send_goal") goals = part.channel.value;
  s.did();
  s.say(1, Attach{{goals}, {1}});
  EXPECT_EQ(s.did(),
            "call_service 1 /fib/_action/send_goal\n"
            "subscribe 2 /fib/_action/feedback reliable volatile 100\n"
            "subscribe 3 /fib/_action/status reliable latched 100\n");
  s.take(2, 2, "nobody asked for it");
  EXPECT_EQ(s.said(1), "");
  s.say(1, Withdraw{{{1}}});
  EXPECT_EQ(s.did(), "uncall_service 1\nunsubscribe 2\nunsubscribe 3\n");
}

TEST(SideActions, AGoalBringsTheDemandForItsFeedback) {
  Script s(server({acting("/**")}));
  s.graph({});
  s.join(1);
  s.pass(1500);
  ChannelOffer feedback = channel(1, "/fib/_action/feedback", {origin(1, 9)});
  feedback.type = std::string(kFib) + "_FeedbackMessage";
  ChannelOffer goal = service_channel(2, "/fib/_action/send_goal");
  goal.type = std::string(kFib) + "_SendGoal";
  ChannelOffer status = channel(3, "/fib/_action/status", {origin(1, 10)});
  status.type = "action_msgs/msg/GoalStatusArray";
  goal.action_type = feedback.action_type = status.action_type = kFib;
  s.say(1, Offer{{feedback, goal, status}, true});
  s.say(1, Attached{{2}, {1}, {0}});
  s.did();
  s.said(1);
  s.give(RequestTaken{{1}, {1}, sample("goal")});
  EXPECT_EQ(s.said(1), "demand 1 3 on\n1.1 goal\n");
  s.message(1, 1, 1, "feedback");
  EXPECT_EQ(s.did(), "publish 2 feedback\n");
  s.pass(5000);  // the graph has told of no subscriber
  EXPECT_EQ(s.said(1), "demand 1 3 off\n");
}

TEST(SideParameters, TheServicesOfANodeAreOpenedByItsNameAlone) {
  const auto get = typed(service("/talker/get_parameters"), "rcl_interfaces/srv/GetParameters");
  Script closed(server({callable()}));
  closed.join(1);
  closed.graph({}, {get});
  EXPECT_EQ(closed.said(1), "");
  Script open(server({parameters("/talker")}));
  open.join(1);
  open.graph({},
             {get, typed(service("/other/get_parameters"), "rcl_interfaces/srv/GetParameters")});
  EXPECT_EQ(open.said(1), "offer 1/talker/get_parameters[]\n");
}

TEST(SideParameters, EventsOfOpenedNodesAloneAreExported) {
  Script s(server({parameters("/talker")}));
  s.join(1);
  auto events = typed(topic("/parameter_events").pub(1, {}, "talker").pub(2, {}, "other"), kEvents);
  s.graph({events});
  const auto offer = offered(s, 1);
  ASSERT_EQ(offer.size(), 1U);
  ASSERT_EQ(offer[0].origins.size(), 1U);
  EXPECT_EQ(offer[0].origins[0].node, "/talker");
  s.demand(1, 1);
  s.did();
  const auto take = [&](std::uint8_t publisher, const Payload& sample) {
    s.give(MessageTaken{{2}, gid(publisher), 1, sample});
  };
  take(2, event("/other"));
  take(2, event("/talker"));
  take(1, event("/other"));  // whoever publishes it
  take(1, sample("no event"));
  take(1, event("/talker"));
  s.graph({typed(events.pub(3, {}, "third"), kEvents)});
  take(3, event("/third"));
  const std::string origin = std::to_string(offer[0].origins[0].origin.value);
  EXPECT_EQ(s.said(1), "1." + origin + " " + text_of(event("/talker").view()) + "\n");
  EXPECT_EQ(s.dropped(DropReason::kNotPermitted), 2U);
  s.give(PolicyChanged{Policy({parameters("/other")})});
  const auto again = offered(s, 1);
  ASSERT_EQ(again.size(), 1U);
  ASSERT_EQ(again[0].origins.size(), 1U);
  EXPECT_EQ(again[0].origins[0].node, "/other");
}

TEST(SideParameters, ANodeThatIsNotOpenedLeavesWithoutATrace) {
  Script s(server({parameters("/talker")}));
  s.join(1);
  const auto talker = topic("/parameter_events").pub(1, {}, "talker");
  s.graph({typed(Topic(talker).pub(2, {}, "other"), kEvents)});
  offered(s, 1);
  s.graph({typed(talker, kEvents)});
  s.pass(1000);
  s.said(1);
  s.give(PolicyChanged{Policy({parameters("/talker")})});  // nothing new, so nothing is withdrawn
  EXPECT_EQ(s.said(1).find("withdraw"), std::string::npos);
}

TEST(SideParameters, EventsOfOpenedNodesAloneAreImported) {
  Script s(server({parameters("/talker")}));
  s.graph({});
  s.join(1);
  s.pass(1000);
  s.say(1, Offer{{events_of("/talker", "/other")}, true});
  EXPECT_EQ(s.did(), "mirror 2 /parameter_events reliable volatile 10\nclaim [5]\n");
  s.give(PolicyChanged{Policy({parameters("/else")})});
  s.pass(300);
  EXPECT_EQ(s.did(), "unmirror 2\nclaim []\n");
}

// Every node acts upon an event with its name.
TEST(SideParameters, AnEventIsOfItsOriginsNodeAndOfNoneThatLivesHere) {
  Script s(server({parameters("/**")}));
  const auto local = typed(topic("/parameter_events").pub(1, {}, "amcl").sub(1), kEvents);
  s.graph({local});
  s.join(1);
  s.pass(1000);
  s.say(1, Offer{{events_of("/talker", "/amcl")}, true});
  s.said(1);
  s.did();
  const auto message = [&](std::uint32_t origin, const Payload& body) {
    s.message(1, 1, origin, body, Codec::kNone, static_cast<std::uint32_t>(body.size()));
  };
  message(1, event("/amcl"));
  message(2, event("/amcl"));
  message(1, sample("no event"));
  EXPECT_EQ(s.did(), "");
  const auto topics = s.status().links.at(0).topics;  // the local one is exported
  EXPECT_EQ(topics.back().dropped.of(DropReason::kNotPermitted), 3U);
  message(1, event("/talker"));
  EXPECT_EQ(s.did(), "publish 2 " + text_of(event("/talker").view()) + "\n");
}

// ROS reads more representations than middlewares write: events that this side cannot read are not
// forwarded.
TEST(SideParameters, AnEventInAnotherRepresentationIsNobodys) {
  Script s(server({parameters("/**")}));
  s.graph({typed(topic("/parameter_events").sub(1), kEvents)});
  s.join(1);
  s.pass(1000);
  s.say(1, Offer{{events_of("/talker", "/amcl")}, true});
  s.said(1);
  s.did();
  const Payload plain = event("/talker");
  for (std::uint8_t kind = 0; kind <= 0x0b; ++kind) {
    Bytes bytes(plain.view().begin(), plain.view().end());
    bytes[1] = kind;
    s.message(1, 1, 1, Payload::copy_of(bytes), Codec::kNone,
              static_cast<std::uint32_t>(bytes.size()));
  }
  EXPECT_EQ(s.did(), "publish 2 " + text_of(plain.view()) + "\n");
  EXPECT_EQ(s.dropped(DropReason::kNotPermitted), 11U);
}

}  // namespace
}  // namespace connect_bridge::side_test
