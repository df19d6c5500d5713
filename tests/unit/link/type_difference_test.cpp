// What the log says of a type that has another definition at a peer.
#include "core/link/link_audit.hpp"

#include <gtest/gtest.h>

#include "unit/topics/one_link.hpp"

namespace connect_bridge::topics_test {
namespace {

const std::string kHere = "RIHS01_" + std::string(64, 'a');
const std::string kThere = "RIHS01_" + std::string(64, 'b');
const std::string kLine = "the definition of p/msg/T here (" + kHere + ") is not that of /peer";

struct Told {
  std::string tell(const std::string& what, const std::string& hash_there, bool used = false) {
    log_difference(outputs, peer.link, {what, "p/msg/T", kHere, hash_there, used});
    std::string lines;
    while (const auto action = outputs.next()) lines += std::get<Log>(*action).text + "\n";
    return lines;
  }

  OneLink peer;
  Outputs outputs;
};

TEST(TypeDifference, NamesBothHashesAndWhatToDo) {
  Told s;
  EXPECT_EQ(s.tell("/a of /talker", kThere),
            "cannot mirror /a of /talker: " + kLine + " at 10.0.0.1 (" + kThere +
                "). Install the same version of p on both sides, or set allow_type_mismatch in the "
                "rule\n");
}

TEST(TypeDifference, OneThatIsUsedNeverthelessIsAnotherLine) {
  Told s;
  s.tell("/a", kThere);
  EXPECT_EQ(s.tell("/a", kThere, true),
            "/a: " + kLine + " at 10.0.0.1 (" + kThere +
                "). Messages that do not fit the definition here are dropped\n");
}

TEST(TypeDifference, IsToldOnceForATypeAndHash) {
  Told s;
  EXPECT_NE(s.tell("/a", kThere), "");
  EXPECT_EQ(s.tell("/b", kThere), "");
  EXPECT_NE(s.tell("/b", "RIHS01_other"), "");
}

TEST(TypeDifference, WhatIsNoHashIsCutAndText) {
  Told s;
  const std::string line = s.tell("/a", "\n" + std::string(200, 'x'));
  EXPECT_NE(line.find("(?" + std::string(70, 'x') + ")"), std::string::npos) << line;
}

}  // namespace
}  // namespace connect_bridge::topics_test
