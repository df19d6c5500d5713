// What sides tell each other about the types of services, as a script.
#include <gmock/gmock.h>

#include "core/types/type_description.hpp"
#include "unit/services/calls_script.hpp"
#include "unit/side/script.hpp"
#include "unit/types/descriptions.hpp"

namespace connect_bridge::side_test {
namespace {

using testing::HasSubstr;

std::string text_with(const std::string& field_name) {
  return canonical_text(description(kServiceType,
                                    {nested_field("request_message", "p/srv/S_Request")},
                                    {{"p/srv/S_Request", {field(field_name, FieldKind::kInt32)}}}));
}
const std::string kThere = text_with("there");
const std::string kHere = text_with("here");

// Peer 1 offers /s on channel 1; the side is attached, and mirror 1 exists.
void mirrors(Script& s) {
  s.graph({});
  s.join(1);
  s.pass(kDiscovered);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  s.say(1, Attached{{1}, {1}, {0}, {}, type_hash_of(kThere)});
  s.did();
  s.said(1);
}

TEST(ServiceTypes, OfAServiceThatIsNotInstalledThePeerIsAsked) {
  Script s(server({callable()}));
  mirrors(s);
  s.give(ServiceTypeDiffers{{1}, ""});
  EXPECT_EQ(s.said(1), "describe 1\n");
  s.say(1, Description{{1}, kThere});
  EXPECT_EQ(s.did(), "describe_type p/srv/S\n");
}

TEST(ServiceTypes, AnotherTextThanTheHashsEndsTheConnection) {
  Script s(server({callable()}));
  mirrors(s);
  s.give(ServiceTypeDiffers{{1}, ""});
  s.say(1, Description{{1}, kHere});
  EXPECT_EQ(s.did(), "close 1 4002\n");
}

TEST(ServiceTypes, TheDescriptionIsFreedWithTheMirrorAndTheOffer) {
  Script s(server({callable()}));
  mirrors(s);
  s.give(ServiceTypeDiffers{{1}, ""});
  s.said(1);
  s.say(1, Description{{1}, kThere});
  s.say(1, Withdraw{{{1}}});
  s.did();
  // Nothing is known of it any longer.
  s.say(1, Offer{{service_channel(2, "/s")}});
  s.say(1, Attached{{2}, {2}, {0}, {}, type_hash_of(kThere)});
  s.did();
  s.said(1);
  s.give(ServiceTypeDiffers{{2}, ""});
  EXPECT_EQ(s.said(1), "describe 2\n");
}

TEST(ServiceTypes, AnotherConnectionIsAskedAnew) {
  Script s(server({callable()}));
  s.graph({});
  const auto session = s.join(1);
  s.pass(kDiscovered);
  s.say(1, Offer{{service_channel(1, "/s")}, true});
  s.say(1, Attached{{1}, {1}, {0}, {}, type_hash_of(kThere)});
  s.give(ServiceTypeDiffers{{1}, ""});
  s.said(1);
  s.lose(1);
  s.join(2, session);
  s.say(2, Offer{{service_channel(1, "/s")}, true});
  s.said(2);
  s.did();
  s.say(2, Attached{{1}, {2}, {0}, {}, type_hash_of(kThere)});
  EXPECT_EQ(s.said(2), "describe 1\n");
  s.say(2, Description{{1}, kThere});
  EXPECT_EQ(s.did(), "describe_type p/srv/S\n");
}

TEST(ServiceTypes, HowTwoDefinitionsDifferIsALine) {
  Script s(server({callable()}));
  mirrors(s);
  s.give(ServiceMirrorFailed{{1}, "type_mismatch", "other hash", type_hash_of(kHere)});
  EXPECT_EQ(s.said(1), "describe 1\ndecline 1 type_mismatch\nwithdraw 1\n");
  s.say(1, Description{{1}, kThere});
  s.give(TypeLookedUp{{1}, kHere});
  s.did();
  EXPECT_THAT(s.logged, HasSubstr("cannot mirror /s: the definition of p/srv/S here"));
  EXPECT_THAT(s.logged, HasSubstr("'there' (int32) is only in the peer's definition"));
  EXPECT_THAT(s.logged, HasSubstr("allow_type_mismatch"));
}

TEST(ServiceTypes, OneThatIsUsedNeverthelessIsALineToo) {
  Rule brave = callable();
  brave.treatment.allow_type_mismatch = true;
  Script s(server({brave}));
  mirrors(s);
  s.give(ServiceTypeDiffers{{1}, type_hash_of(kHere)});
  s.say(1, Description{{1}, kThere});
  s.give(TypeLookedUp{{1}, kHere});
  s.did();
  EXPECT_THAT(s.logged, HasSubstr("\n/s: the definition of p/srv/S here"));
  EXPECT_THAT(s.logged, HasSubstr("Messages that do not fit"));
}

TEST(ServiceTypes, APeerIsToldWhatAnInstalledServiceIs) {
  Script s(server({callable()}));
  s.graph({}, {service("/s")});
  s.join(1);
  // Nobody has called it yet: the hash is not known.
  s.say(1, Describe{{{1}}});
  EXPECT_THAT(s.said(1), HasSubstr("description 1 unknown\n"));
  s.say(1, Attach{{1}, {1}});
  s.give(ServiceReady{{1}, true, type_hash_of(kThere)});
  s.did();
  s.said(1);
  s.say(1, Describe{{{1}}});
  EXPECT_EQ(s.did(), "look_up 1 p/srv/S " + type_hash_of(kThere) + "\n");
  s.give(TypeLookedUp{{1}, kThere});
  EXPECT_THAT(s.said(1), HasSubstr("description 1\n"));
}

}  // namespace
}  // namespace connect_bridge::side_test
