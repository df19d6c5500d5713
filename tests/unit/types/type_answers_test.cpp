// What peers ask about types, as a script.
#include <gmock/gmock.h>

#include "core/base/cdr.hpp"
#include "core/types/description_service.hpp"
#include "core/types/type_description.hpp"
#include "unit/side/script.hpp"
#include "unit/types/descriptions.hpp"

namespace connect_bridge::side_test {
namespace {

using testing::HasSubstr;

const TypeDescription kAnswered =
    description(kType,
                {nested_field("parts", "p/msg/U", FieldShape::kSequence),
                 {"name", FieldKind::kBoundedString, FieldShape::kSingle, 0, 10}},
                {{"p/msg/U", {field("x", FieldKind::kDouble, FieldShape::kArray, 3)}}});
const std::string kAnsweredText = canonical_text(kAnswered);

Topic typed(const std::string& name) {
  Topic made = topic(name);
  made.type_hash = type_hash_of(kAnsweredText);
  return made;
}

// Peer 1 is offered /a of the node /n on channel 1.
struct TypeAnswers : Script {
  TypeAnswers() : Script(server()) {
    graph({typed("/a").pub(1, qos(), "n"), topic("/b").pub(2)});
    pass(1000);
    join(1);
    said(1);
    did();
  }
};

void write(CdrWriter& to, const DescribedType& type) {
  to.string(type.name).u32(static_cast<std::uint32_t>(type.fields.size()));
  for (const auto& f : type.fields) {
    const auto id = static_cast<unsigned>(f.kind) + 48 * static_cast<unsigned>(f.shape);
    to.string(f.name).u8(static_cast<std::uint8_t>(id)).u64(f.capacity).u64(f.string_capacity);
    to.string(f.nested).string("default");
  }
}

Payload response_of(const TypeDescription& described, bool known = true) {
  CdrWriter to;
  to.u8(known ? 1 : 0).string(known ? "" : "no such type");
  write(to, described.type);
  to.u32(static_cast<std::uint32_t>(described.nested.size()));
  for (const auto& nested : described.nested) write(to, nested);
  return to.u32(0).u32(0).take();
}

TEST(TypeAnswers, FromTheInstalledPackage) {
  TypeAnswers s;
  s.say(1, Describe{{{1}}});
  EXPECT_EQ(s.did(), "look_up 1 p/msg/T " + type_hash_of(kAnsweredText) + "\n");
  EXPECT_EQ(s.said(1), "");
  s.give(TypeLookedUp{{1}, kAnsweredText});
  EXPECT_EQ(s.said(1), "description 1\n");
  EXPECT_EQ(s.did(), "");
}

// The peer would end the connection.
TEST(TypeAnswers, WhatIsTooLongIsNotKnown) {
  const std::string text(kDescriptionBytesMax + 1, 'x');
  Script s(server());
  Topic large = topic("/a").pub(1);
  large.type_hash = type_hash_of(text);
  s.graph({large});
  s.pass(1000);
  s.join(1);
  s.said(1);
  s.say(1, Describe{{{1}}});
  s.give(TypeLookedUp{{1}, text});
  EXPECT_EQ(s.said(1), "description 1 unknown\n");
}

TEST(TypeAnswers, FromTheNodeThatHasTheType) {
  TypeAnswers s;
  s.say(1, Describe{{{1}}});
  s.did();
  s.give(TypeLookedUp{{1}, ""});
  EXPECT_EQ(s.did(), "call_service 1 /n/get_type_description\n");
  s.give(ServiceReady{{1}, true, ""});
  EXPECT_THAT(s.did(), HasSubstr("invoke 1.1 "));
  s.give(ResponseTaken{{1}, {1}, response_of(kAnswered)});
  EXPECT_EQ(s.said(1), "description 1\n");
  EXPECT_EQ(s.did(), "uncall_service 1\n");
}

TEST(TypeAnswers, ANodeIsNotBelieved) {
  for (const Payload& told : {response_of(kAnswered, false),
                              response_of(description(kType, {field("x", FieldKind::kInt8)})),
                              Payload::adopt({0, 1, 0, 0, 1}), Payload{}}) {
    TypeAnswers s;
    s.say(1, Describe{{{1}}});
    s.give(TypeLookedUp{{1}, ""});
    s.give(ServiceReady{{1}, true, ""});
    s.give(ResponseTaken{{1}, {1}, told});
    EXPECT_EQ(s.said(1), "description 1 unknown\n");
  }
}

TEST(TypeAnswers, ANodeIsNotWaitedForWithoutEnd) {
  TypeAnswers s;
  s.say(1, Describe{{{1}}});
  s.give(TypeLookedUp{{1}, ""});
  s.did();
  s.pass(1'900);
  EXPECT_EQ(s.said(1), "");
  s.pass(200);
  EXPECT_EQ(s.said(1), "description 1 unknown\n");
  EXPECT_EQ(s.did(), "uncall_service 1\n");
  s.give(ServiceReady{{1}, true, ""});
  EXPECT_EQ(s.did(), "");
}

TEST(TypeAnswers, WithoutAHashOrANodeItIsNotKnown) {
  TypeAnswers s;
  s.say(1, Describe{{{2}}});
  EXPECT_EQ(s.said(1), "description 2 unknown\n");
  EXPECT_EQ(s.did(), "");
  s.say(1, Describe{{{1}}});
  s.did();
  s.give(TypeLookedUp{{1}, ""});
  s.give(ServiceClientFailed{{1}, "type_unknown", "not installed"});
  EXPECT_EQ(s.said(1), "description 1 unknown\n");
}

TEST(TypeAnswers, WhatThePeerIsNotOfferedIsNotTold) {
  TypeAnswers s;
  s.say(1, Describe{{{3}}});
  EXPECT_THAT(s.did(), HasSubstr("close 1 4010"));
}

TEST(TypeAnswers, WhatIsWithdrawnIsNotAnswered) {
  TypeAnswers s;
  s.say(1, Describe{{{1}}});
  s.graph({topic("/b").pub(2)});
  s.pass(2'000);
  EXPECT_THAT(s.said(1), HasSubstr("withdraw 1"));
  s.give(TypeLookedUp{{1}, kAnsweredText});
  EXPECT_EQ(s.said(1), "");
  s.say(1, Describe{{{1}}});  // it crossed the withdraw
  EXPECT_EQ(s.did().find("close"), std::string::npos);
}

TEST(TypeAnswers, TwiceAtATimeIsRefused) {
  TypeAnswers s;
  s.say(1, Describe{{{1}, {1}}});
  EXPECT_THAT(s.did(), HasSubstr("close 1 4009"));
}

TEST(TypeAnswers, NoMoreThanEightAtATime) {
  Script s(server());
  std::vector<Topic> topics;
  for (char name = 'a'; name < 'a' + 9; ++name)
    topics.push_back(typed(std::string("/") + name).pub(static_cast<std::uint8_t>(name), qos()));
  s.graph(topics);
  s.pass(1000);
  s.join(1);
  s.say(1, Describe{{{1}, {2}, {3}, {4}, {5}, {6}, {7}, {8}}});
  EXPECT_EQ(s.did().find("close"), std::string::npos);
  s.say(1, Describe{{{9}}});
  EXPECT_THAT(s.did(), HasSubstr("close 1 4006"));
}

TEST(TypeAnswers, ALostPeerIsNotAnswered) {
  TypeAnswers s;
  s.say(1, Describe{{{1}}});
  s.give(TypeLookedUp{{1}, ""});
  s.did();
  s.lose(1);
  EXPECT_THAT(s.did(), HasSubstr("uncall_service 1"));
}

TEST(TypeAnswers, AsOftenAsThePaceAllows) {
  TypeAnswers s;
  std::size_t looked_up = 0;
  for (std::uint32_t i = 1; i <= 5000; ++i) {
    s.say(1, Describe{{{1}}});
    if (s.did().empty()) continue;
    ++looked_up;
    s.give(TypeLookedUp{{i}, kAnsweredText});
  }
  EXPECT_EQ(looked_up, 4096U);
}

}  // namespace
}  // namespace connect_bridge::side_test
