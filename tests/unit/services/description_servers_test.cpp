// Nodes here that tell what peers' types are made of, as a script.
#include <gmock/gmock.h>

#include "core/base/cdr.hpp"
#include "core/types/description_service.hpp"
#include "unit/services/calls_script.hpp"
#include "unit/side/script.hpp"
#include "unit/types/descriptions.hpp"

namespace connect_bridge::side_test {
namespace {

using testing::HasSubstr;
using testing::Not;

const TypeDescription kServed =
    description(kType, {nested_field("parts", "p/msg/U", FieldShape::kSequence)},
                {{"p/msg/U", {field("x", FieldKind::kDouble, FieldShape::kArray, 3)}}});
const std::string kServedText = canonical_text(kServed);
const std::string kServedHash = type_hash_of(kServedText);

SideOptions describing(bool proxies) {
  SideOptions options = client({callable()});
  options.describes_types = true;
  options.proxy_nodes = proxies;
  return options;
}

// The peer has offered /a of its node on channel 1: mirror 2, of a type that is not installed.
struct Describing : Script {
  explicit Describing(bool proxies = true) : Script(describing(proxies)) {
    graph({});
    be_welcomed(1);
    say(1, Accepts{});
    pass(1000);
    ChannelOffer offer = channel(1, "/a", {origin(1, 11)});
    offer.type_hash = kServedHash;
    offer.origins.front().node = "/talker";
    say(1, Offer{{offer}, true});
    pass(1);
    did();
    said(1);
    give(TypeDiffers{{2}, ""});
    said(1);
  }
  void asks(std::uint32_t mirror, std::uint32_t request, const std::string& type,
            const std::string& hash, bool sources = false) {
    Payload bytes = CdrWriter{}.string(type).string(hash).u8(sources ? 1 : 0).take();
    give(RequestTaken{{mirror}, {request}, std::move(bytes)});
  }
};

std::string response(std::uint32_t mirror, std::uint32_t request, const Payload& payload) {
  return "respond " + std::to_string(mirror) + "." + std::to_string(request) + " " +
         text_of(payload.view()) + "\n";
}

std::string known(std::uint32_t mirror, std::uint32_t request, bool sources = false) {
  return response(mirror, request, description_response(kServed, sources));
}

std::string unknown(std::uint32_t mirror, std::uint32_t request, const std::string& type) {
  return response(mirror, request,
                  description_refusal("the type " + type + " with this hash is not known here"));
}

std::string too_many(std::uint32_t mirror, std::uint32_t request) {
  return response(mirror, request,
                  description_refusal("too many types are asked for at a time: ask again later"));
}

TEST(DescriptionServers, TheNodeOfAMirrorAndOurOwnHaveOneAsLongAsAMirrorNeedsIt) {
  Describing s;
  EXPECT_EQ(s.did(),
            "mirror_service 1 /own/get_type_description\n"
            "mirror_service 2 /talker/get_type_description\n");
  s.say(1, Withdraw{{{1}}});
  s.pass(60'000);
  EXPECT_THAT(s.did(), HasSubstr("unmirror_service 1\nunmirror_service 2\n"));
}

TEST(DescriptionServers, WithoutProxiesOnlyOurOwnNodeHasOne) {
  Describing s(false);
  EXPECT_EQ(s.did(), "mirror_service 1 /own/get_type_description\n");
}

TEST(DescriptionServers, NoneWhereTheGraphHasThatService) {
  Describing s;
  s.did();
  s.graph({}, {service("/talker/get_type_description")});
  EXPECT_EQ(s.did(), "unmirror_service 2\n");
  s.graph({});
  EXPECT_EQ(s.did(), "mirror_service 3 /talker/get_type_description\n");
}

TEST(DescriptionServers, NoneWhereThePeersIsMirrored) {
  Describing s;
  s.did();
  s.say(1, Offer{{service_channel(2, "/talker/get_type_description")}});
  s.say(1, Attached{{2}, {1}, {0}});
  EXPECT_THAT(s.did(), HasSubstr("unmirror_service 2\n"));
}

// It may have nodes of the same names, and answer for them.
TEST(DescriptionServers, BesideAnotherBridgeOnlyOurOwnNodeHasOne) {
  Describing s;
  s.did();
  s.graph({topic("/_connect_bridge/claims").pub(9, {}, "bridge")});
  EXPECT_THAT(s.did(), HasSubstr("unmirror_service 2\n"));
  s.graph({});
  EXPECT_THAT(s.did(), HasSubstr("mirror_service 3 /talker/get_type_description\n"));
}

TEST(DescriptionServers, APeerDoesNotAnswerForOurOwnNode) {
  Describing s;
  s.did();
  s.say(1, Offer{{service_channel(2, "/own/get_type_description")}});
  s.say(1, Attached{{2}, {1}, {0}});
  s.pass(1000);
  EXPECT_THAT(s.did(), Not(HasSubstr("mirror_service")));
}

TEST(DescriptionServers, OneThatFailsIsNotTriedAgain) {
  Describing s;
  s.did();
  s.give(ServiceMirrorFailed{{2}, "type_unknown", "not installed"});
  s.graph({});
  EXPECT_EQ(s.did(), "");
}

TEST(DescriptionServers, TellWhatThePeerHasTold) {
  Describing s;
  s.say(1, Description{{1}, kServedText});
  s.did();
  s.asks(2, 1, kType, kServedHash);
  EXPECT_EQ(s.did(), "look_up 1 p/msg/T " + kServedHash + "\n");
  s.give(TypeLookedUp{{1}, ""});
  EXPECT_EQ(s.did(), known(2, 1));
  s.asks(1, 1, kType, kServedHash, true);
  s.give(TypeLookedUp{{2}, ""});
  EXPECT_THAT(s.did(), HasSubstr(known(1, 1, true)));
}

TEST(DescriptionServers, WaitForWhatThePeerWillTell) {
  Describing s;
  s.did();
  s.asks(2, 1, kType, kServedHash);
  s.give(TypeLookedUp{{1}, ""});
  EXPECT_THAT(s.did(), Not(HasSubstr("respond")));
  s.say(1, Description{{1}, kServedText});
  EXPECT_THAT(s.did(), HasSubstr(known(2, 1)));
}

TEST(DescriptionServers, TellWhatIsInstalled) {
  Describing s;
  s.did();
  s.asks(1, 1, kType, kServedHash);
  s.did();
  s.give(TypeLookedUp{{1}, kServedText});
  EXPECT_EQ(s.did(), known(1, 1));
}

TEST(DescriptionServers, KnowOnlyWhatHasTheHash) {
  Describing s;
  s.say(1, Description{{1}, kServedText});
  s.did();
  s.asks(2, 1, kType, "RIHS01_00");
  s.give(TypeLookedUp{{1}, ""});
  EXPECT_THAT(s.did(), HasSubstr(unknown(2, 1, kType)));
  // A package that is installed wrongly.
  s.asks(2, 2, kType, "RIHS01_00");
  s.give(TypeLookedUp{{2}, kServedText});
  EXPECT_THAT(s.did(), HasSubstr(unknown(2, 2, kType)));
  // The hash of another type.
  s.asks(2, 3, "p/msg/V", kServedHash);
  s.give(TypeLookedUp{{3}, kServedText});
  EXPECT_THAT(s.did(), HasSubstr(unknown(2, 3, "p/msg/V")));
}

TEST(DescriptionServers, AnswerInTimeAndOnlyOnce) {
  Describing s;
  s.did();
  s.asks(2, 1, kType, kServedHash);
  s.asks(2, 2, kType, kServedHash);
  s.give(TypeLookedUp{{1}, ""});
  s.give(CallersGone{{2}, {{2}}});
  s.pass(5000);
  const std::string answers = s.did();
  EXPECT_THAT(answers, HasSubstr(unknown(2, 1, kType)));
  EXPECT_THAT(answers, Not(HasSubstr("respond 2.2")));
  s.give(TypeLookedUp{{2}, kServedText});
  EXPECT_THAT(s.did(), Not(HasSubstr("respond")));
}

TEST(DescriptionServers, KeepNoMoreThanSoManyCallsAndOneServerHalfOfThem) {
  Describing s;
  s.did();
  for (std::uint32_t i = 1; i <= DescriptionCalls::kServerCallsMax; ++i)
    s.asks(2, i, kType, kServedHash);
  EXPECT_THAT(s.did(), Not(HasSubstr("respond")));
  s.asks(2, 1000, kType, kServedHash);
  EXPECT_EQ(s.did(), too_many(2, 1000));
  for (std::uint32_t i = DescriptionCalls::kServerCallsMax; i < DescriptionCalls::kCallsMax; ++i)
    s.asks(1, i, kType, kServedHash);
  EXPECT_THAT(s.did(), Not(HasSubstr("respond")));
  s.asks(1, 1000, kType, kServedHash);
  EXPECT_EQ(s.did(), too_many(1, 1000));
}

// How many of so many questions that are asked one after the other, and answered at once, are
// looked up.
int looked_up(Describing& s, std::uint32_t server, int questions) {
  int count = 0;
  for (int i = 0; i < questions; ++i) {
    s.asks(server, 1, kType, kServedHash);
    const std::string done = s.did();
    if (!done.starts_with("look_up ")) continue;
    ++count;
    const auto lookup = static_cast<std::uint32_t>(std::stoul(done.substr(8)));
    s.give(TypeLookedUp{{lookup}, kServedText});
    s.did();
  }
  return count;
}

TEST(DescriptionServers, AnswerEachCallerOfOneServerAtAPace) {
  Describing s;
  s.did();
  EXPECT_EQ(looked_up(s, 2, 1000), DescriptionCalls::kServerAtOnceMax);
  s.asks(2, 1, kType, kServedHash);
  EXPECT_EQ(s.did(), too_many(2, 1));
  EXPECT_EQ(looked_up(s, 1, 1), 1);  // the other one's callers are answered
  s.pass(1000);
  s.did();
  EXPECT_EQ(looked_up(s, 2, 1000), 20);
}

TEST(DescriptionServers, AllTogetherAnswerAtAPace) {
  Describing s;
  for (std::uint32_t i = 2; i <= 4; ++i) {
    ChannelOffer offer = channel(i, "/a" + std::to_string(i), {origin(1, 10 + i)});
    offer.type_hash = kServedHash;
    offer.origins.front().node = "/talker" + std::to_string(i);
    s.say(1, Offer{{offer}});
    s.pass(1);
    s.give(TypeDiffers{{i + 1}, ""});
  }
  EXPECT_THAT(s.did(), HasSubstr("mirror_service 5 /talker4/get_type_description"));
  int count = 0;
  for (std::uint32_t server = 1; server <= 5; ++server) count += looked_up(s, server, 1000);
  EXPECT_EQ(count, DescriptionCalls::kAtOnceMax);
}

TEST(DescriptionServers, BytesThatAreNoRequestAreDropped) {
  Describing s;
  s.did();
  s.give(RequestTaken{{2}, {1}, sample("?")});
  EXPECT_EQ(s.did(), "drop_request 2.1\n");
}

// As a client of ROS reads it (the layout is checked with real clients, e2e/test_types.py).
TEST(DescriptionServers, AResponseIsReadAsANodesIs) {
  EXPECT_EQ(text_of_response(description_response(kServed, true).view()), kServedText);
  EXPECT_EQ(text_of_response(description_refusal("why").view()), std::nullopt);
  const auto request = read_description_request(description_request(kType, kServedHash).view());
  ASSERT_TRUE(request);
  EXPECT_EQ(request->type, kType);
  EXPECT_EQ(request->hash, kServedHash);
  EXPECT_FALSE(request->with_sources);
}

}  // namespace
}  // namespace connect_bridge::side_test
