// What may be here of what a peer offers.
#include "core/offers/import_right.hpp"

#include <gtest/gtest.h>

#include "unit/topics/one_link.hpp"

namespace connect_bridge::topics_test {
namespace {

constexpr const char* kServiceType = "std_srvs/srv/Trigger";

struct Imported : Actions {
  explicit Imported(std::vector<Rule> rules = {everything()}) { policy = Policy(std::move(rules)); }

  // Its name here; empty: it is declined, and `said` tells with which code.
  std::string name_here(InterfaceKind kind, const std::string& name, const std::string& type) {
    ChannelOffer offer = channel(1, name, {});
    offer.kind = kind;
    offer.type = type;
    const auto import = judge(side, peer.link, offer);
    said = peer.said();
    return import ? import->key.first : "";
  }
  std::string topic(const std::string& name, const std::string& type = kType) {
    return name_here(InterfaceKind::kTopic, name, type);
  }
  std::string service(const std::string& name, const std::string& type = kServiceType) {
    return name_here(InterfaceKind::kService, name, type);
  }

  OneLink peer;
  std::string said;
};

Rule both(const char* name) {
  Rule made = rule({}, {name});
  made.opens[Direction::kImport][OpenedBy::kServices] = {Pattern::parse(name).value()};
  return made;
}

TEST(ImportRight, NeedsARuleAndAProperNameAndType) {
  Imported s({both("/**")});
  EXPECT_EQ(s.topic("/a"), "/a");
  EXPECT_EQ(s.service("/a"), "/a");
  EXPECT_EQ(s.said, "");
  EXPECT_EQ(s.name_here(InterfaceKind::kOther, "/a", kType), "");
  EXPECT_EQ(s.said, "decline 1 unsupported\n");
  for (const char* name : {"", "a", "/a/", "//a", "/a b", "/1a", "/a\n"}) {
    EXPECT_EQ(s.topic(name) + s.service(name), "") << name;
    EXPECT_EQ(s.said, "decline 1 not_permitted\n") << name;
  }
  for (const char* type : {"", "T", "p/msg/T/U", "p/msg/", "p/srv/"})
    EXPECT_EQ(s.topic("/a", type) + s.service("/a", type), "") << type;
  EXPECT_EQ(s.topic("/a", kServiceType) + s.service("/a", kType), "");
  s.policy = Policy({both("/b")});
  EXPECT_EQ(s.topic("/a") + s.service("/a"), "");
  EXPECT_EQ(s.said, "decline 1 not_permitted\n");
}

TEST(ImportRight, ANameHereBelongsToTheNameThatItIsMappedTo) {
  Imported s({both("/**")});
  s.peer.link.names = NameMap("/robot", {{"/far", "/robot/near"}});
  EXPECT_EQ(s.topic("/far"), "/robot/near");
  EXPECT_EQ(s.service("/far"), "/robot/near");
  EXPECT_EQ(s.topic("/near") + s.service("/near"), "");
  EXPECT_EQ(s.said, "decline 1 not_permitted\n");
}

TEST(ImportRight, LaterItIsAskedByTheNameHere) {
  Imported s({both("/far")});
  s.peer.link.names = NameMap("/robot", {{"/far", "/robot/near"}});
  for (const InterfaceKind kind : {InterfaceKind::kTopic, InterfaceKind::kService}) {
    const std::string type = kind == InterfaceKind::kTopic ? kType : kServiceType;
    EXPECT_TRUE(import_right(s.side, s.peer.link, kind, {"/robot/near", type}, ""));
    EXPECT_FALSE(import_right(s.side, s.peer.link, kind, {"/robot/far", type}, ""));
    EXPECT_FALSE(import_right(s.side, s.peer.link, kind, {"/near", type}, ""));
  }
}

// No pattern for topics opens them.
TEST(ImportRight, ParameterEventsComeFromNodesWhoseParametersARuleOpens) {
  Rule opening = rule({}, {});
  opening.opens[Direction::kImport][OpenedBy::kParameters] = {Pattern::parse("/talker").value()};
  Imported s({opening});
  for (const char* type : {"no type", "p/msg/T"})
    EXPECT_EQ(s.topic("/parameter_events", type), "") << type;
  EXPECT_EQ(s.topic("/parameter_events", kParameterEventType.data()), "/parameter_events");
  EXPECT_FALSE(withholds_events(s.side, s.peer.link, "/talker"));
  EXPECT_TRUE(withholds_events(s.side, s.peer.link, "/listener"));
  EXPECT_TRUE(withholds_events(s.side, s.peer.link, ""));
}

}  // namespace
}  // namespace connect_bridge::topics_test
